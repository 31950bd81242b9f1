# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Draw the pictures of docs/view.md: what `rotor-rig view` shows of a flight and of an import.

Usage: python docs/make_view_pictures.py [FOLDER [IMAGES]]

FOLDER holds ota_mle_runup/; default: the environment variable ROTOR_RIG_REALDATA, else
../shared/realdata. Without it the script says so and draws the flight alone. Each picture carries
the words that it shows (PNG text `Description`), so that a test can tell when they have changed.
"""

import os
import sys
import tempfile
from pathlib import Path

from PIL import Image
from PIL.PngImagePlugin import PngInfo
from rerun.chunk import RrdReader

from rotor_recording.importing.convert import ImportPlan, convert, write
from rotor_rig.pipeline import record
from rotor_rig.scenario_model import load_scenario
from rotor_view import style, view_recording

ROOT = Path(__file__).resolve().parents[1]
IMAGES = ROOT / 'docs' / 'images'
FLIGHT, DURATION_S = 'climb_dive', 17.5
IMPORT = 'imported_run_up'


def fly(out: Path) -> None:
    """Write the recording of the flight."""
    for _ in record(load_scenario(FLIGHT, duration_s=DURATION_S), out):
        pass


def bring(folder: Path, out: Path) -> None:
    """Write the recording of the run-up in docs/real_data.md."""
    path = folder / 'ota_mle_runup' / 'plateVib.txt'
    write(convert(ImportPlan(path, channels={'plate_z': '1'}, tacho='2', rate_hz=1280.0)), out)


def words(view: Path) -> str:
    """Return titles, limits of the alarm and its last sentence, as a saved view shows them."""
    reader = RrdReader(str(view))
    found: dict[str, list[str]] = {}
    for store in (*reader.recordings(), *reader.blueprints()):
        for chunk in reader.stream(store=store):
            batch = chunk.to_record_batch()
            for name, column in zip(batch.schema.names, batch.columns, strict=True):
                path, _, component = f'{chunk.entity_path} {name}'.rpartition(':')
                if component in ('display_name', 'text', 'names'):
                    found[path] = [row for row in column.to_pylist() if row][-1]
    titles = {row[0] for path, row in found.items() if path.endswith(' ViewBlueprint')}
    limits = {
        path.removeprefix(f'/{style.LIMITS}/').removesuffix(' SeriesLines'): ', '.join(row)
        for path, row in found.items()
        if path.startswith(f'/{style.LIMITS}/')
    }
    judged = [
        f'{indicator}: {words}'
        for indicator, words in limits.items()
        if any(title.startswith(f'{indicator} [') for title in titles)
    ]
    sentence = found[f'/{style.ALARM_SENTENCE} TextDocument']
    return '\n'.join([*sentence, *sorted(judged), *sorted(titles)])


def draw(recording: Path, picture: Path) -> None:
    """Draw the page of a recording with its words in it."""
    view = recording.with_suffix('.rrd')
    for sentence in view_recording(recording, save=view, screenshot=picture):
        sys.stderr.write(f'{sentence}\n')
    text = PngInfo()
    text.add_text('Description', words(view))
    with Image.open(picture) as image:
        image.load()
    image.save(picture, pnginfo=text, optimize=True)


def main() -> None:
    """Draw both pictures."""
    arguments = [Path(argument) for argument in sys.argv[1:]]
    default = os.environ.get('ROTOR_RIG_REALDATA', ROOT.parent / 'shared' / 'realdata')
    folder = arguments[0] if arguments else Path(default)
    images = arguments[1] if len(arguments) > 1 else IMAGES
    with tempfile.TemporaryDirectory(prefix='rotor-rig-pictures-') as scratch:
        flight, imported = Path(scratch) / 'flight.mcap', Path(scratch) / 'imported.mcap'
        fly(flight)
        draw(flight, images / f'{FLIGHT}.png')
        if not (folder / 'ota_mle_runup').is_dir():
            sys.stdout.write(f'no real data in {folder}, so {IMPORT}.png stays as it is\n')
            return
        bring(folder, imported)
        draw(imported, images / f'{IMPORT}.png')


if __name__ == '__main__':
    main()
