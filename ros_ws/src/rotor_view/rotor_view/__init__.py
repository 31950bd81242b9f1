# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The rerun view of the rig: live, recordings, screenshots. Importing it imports rerun."""

import os

# rerun's allocator reads this when rerun is loaded; without it, it keeps freed memory
os.environ.setdefault('MIMALLOC_PURGE_DELAY', '0')

from rotor_view.offline import view_recording
from rotor_view.rig_view import RigView
from rotor_view.viewer import ViewError

__all__ = ['RigView', 'ViewError', 'view_recording']
