#!/usr/bin/env python3
# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Write setup.py, setup.cfg and package.xml of every package from ros_ws/packages.toml.

What a package depends on is read from its modules. With --check nothing is written; the exit code
is 1 where a file is not what it should be.
"""

import ast
import re
import sys
import tomllib
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any
from xml.sax.saxutils import escape

ROS_WS = Path(__file__).resolve().parent.parent / 'ros_ws'
DISTRIBUTION = {'PIL': 'pillow', 'mpl_toolkits': 'matplotlib', 'rerun': 'rerun-sdk',
                'rerun_cli': 'rerun-sdk', 'yaml': 'pyyaml'}  # fmt: skip
"""Where a module's name is not that of the distribution that brings it."""
ROSDEP_KEYS = {'numpy': 'python3-numpy', 'pillow': 'python3-pil', 'pyyaml': 'python3-yaml',
               'scipy': 'python3-scipy'}  # fmt: skip
"""What a ROS distribution brings in a version that fits."""
ROS_PACKAGE = re.compile(r'rclpy|launch|launch_ros|ament_index_python|\w+_msgs|\w+_interfaces')
HEADER = ('Copyright 2026 The cracked rotor rig authors', 'SPDX-License-Identifier: Apache-2.0')

SETUP = """\
# {header[0]}
# {header[1]}
# Written by scripts/package_files.py from ros_ws/packages.toml.
\"\"\"{sentence}\"\"\"

from glob import glob

from setuptools import find_packages, setup

PACKAGE = '{package}'

setup(
    name=PACKAGE,
    version='{version}',
    description=__doc__,
    author='The cracked rotor rig authors',
    license='Apache-2.0',
    python_requires='{python}',
    package_dir={{'': '.'}},
    packages=find_packages(include=[PACKAGE, f'{{PACKAGE}}.*']),
    package_data={{PACKAGE: ['py.typed', '**/*.csv', '**/*.xml', '**/*.yaml']}},
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{{PACKAGE}}']),
        (f'share/{{PACKAGE}}', ['package.xml']),
        *(
            (f'share/{{PACKAGE}}/{{folder}}', files)
            for folder in ('config', 'launch', 'security')
            if (files := glob(f'{{folder}}/*.*'))
        ),
    ],
{lists}    zip_safe=False,
)
"""

CFG = """\
[develop]
script_dir=$base/lib/{package}
[install]
install_scripts=$base/lib/{package}
"""

MANIFEST = """\
<?xml version="1.0"?>
<?xml-model href="http://download.ros.org/schema/package_format3.xsd" \
schematypens="http://www.w3.org/2001/XMLSchema"?>
<!-- {header[0]} -->
<!-- {header[1]} -->
<!-- Written by scripts/package_files.py from ros_ws/packages.toml. -->
<package format="3">
  <name>{package}</name>
  <version>{version}</version>
  <description>{description}</description>
  <maintainer email="noreply@example.org">The cracked rotor rig authors</maintainer>
  <license>Apache-2.0</license>

{depends}{from_pip}
  <test_depend>python3-pytest</test_depend>

  <export>
    <build_type>ament_python</build_type>
  </export>
</package>
"""


def imported(paths: Iterable[Path]) -> set[str]:
    """Return the top-level names of what the files import, and the packages of message types."""
    found = set()
    for path in paths:
        for node in ast.walk(ast.parse(path.read_text('utf-8'))):
            if isinstance(node, ast.Import):
                found |= {alias.name.partition('.')[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
                found.add(node.module.partition('.')[0])
            elif isinstance(node, ast.Constant) and isinstance(node.value, str):
                found |= set(re.findall(r'\A(\w+)/msg/\w+\Z', node.value))
    return found - set(sys.stdlib_module_names)


def _lists(facts: dict[str, Any], requirements: list[str]) -> str:
    def one(indent: str, key: str, texts: list[str]) -> str:
        items = ''.join(f"{indent}    '{text}',\n" for text in texts)
        return f'{indent}{key}[\n{items}{indent}],\n'

    text = one('    ', 'install_requires=', requirements)
    if extras := facts.get('extras'):
        inner = ''.join(one('        ', f"'{key}': ", value) for key, value in extras.items())
        text += f'    extras_require={{\n{inner}    }},\n'
    points = {'console_scripts': facts.get('console_scripts', [])} | facts.get('entry_points', {})
    if points := {key: value for key, value in points.items() if value}:
        inner = ''.join(one('        ', f"'{key}': ", value) for key, value in points.items())
        text += f'    entry_points={{\n{inner}    }},\n'
    return text


def files_of(package: str, table: dict[str, Any]) -> Iterator[tuple[Path, str]]:
    """Yield (path, text) of the files of a package."""
    folder = ROS_WS / 'src' / package
    facts, version = table['packages'][package], table['version']
    code = imported((folder / package).rglob('*.py')) - {package}
    own = code & set(table['packages'])
    ros = {name for name in code - own if ROS_PACKAGE.fullmatch(name)}
    pip = {DISTRIBUTION.get(name, name) for name in code - own - ros}
    if unknown := pip - set(table['requirements']):
        sys.exit(f'{package} imports {min(unknown)}; add it to [requirements] in packages.toml')
    ros |= imported((folder / 'launch').glob('*.py')) & {'launch', 'launch_ros'}
    requirements = [f'{name}{table["requirements"][name]}' for name in pip]
    requirements += [f'{name}=={version}' for name in own]
    first, _, second = facts['description'].strip().partition('\n')
    common = {'header': HEADER, 'package': package, 'version': version}
    yield (
        folder / 'setup.py',
        SETUP.format(
            **common,
            sentence=first,
            python=table['python'],
            lists=_lists(facts, sorted(requirements)),
        ),
    )
    yield folder / 'setup.cfg', CFG.format(package=package)
    keys = {ROSDEP_KEYS[name] for name in pip & set(ROSDEP_KEYS)}
    groups = [sorted(ros), sorted(own), sorted(keys)]
    depends = ''.join(
        ''.join(f'  <exec_depend>{name}</exec_depend>\n' for name in group) + '\n'
        for group in groups
        if group
    )
    others = ', '.join(sorted(pip - set(ROSDEP_KEYS)))
    from_pip = f'  <!-- From pip (docs/install.md): {others} -->\n' if others else ''
    yield (
        folder / 'package.xml',
        MANIFEST.format(
            **common, description=escape(f'{first} {second}'), depends=depends, from_pip=from_pip
        ),
    )


def main() -> int:
    """Write or check the files; return the exit code."""
    table = tomllib.loads((ROS_WS / 'packages.toml').read_text('utf-8'))
    wrong = []
    for package in table['packages']:
        for path, text in files_of(package, table):
            if '--check' not in sys.argv:
                path.write_text(text, 'utf-8')
            elif not path.exists() or path.read_text('utf-8') != text:
                wrong.append(path)
    for path in wrong:
        print(f'{path.relative_to(ROS_WS)} differs from packages.toml and the imports;')
    if wrong:
        print('run scripts/package_files.py')
    return 1 if wrong else 0


if __name__ == '__main__':
    sys.exit(main())
