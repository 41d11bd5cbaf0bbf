# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Build rules of tactile_perception, run by colcon: the Python modules, and the compiled kernels of src/ as tactile_perception._core.

TACTILE_NATIVE=1 compiles for the processor of this machine alone. TACTILE_SANITIZE=1 compiles checks of addresses and of undefined
behaviour in (make sanitize).
"""

import os
import pathlib
import sys
import sysconfig

from setuptools import Extension, find_packages, setup
from setuptools.command.build_ext import build_ext

PACKAGE = 'tactile_perception'
SOURCE = pathlib.Path(__file__).resolve().parent / 'src'
# -O3: loops over pixels become vector instructions, which -O2 of GCC 11 leaves out. No fused products and no reordered sums: the same
# bits on every processor. Nobody reads errno or traps of arithmetic: without both, loops with roots and choices become vector instructions.
FLAGS = ['-std=c++17', '-O3', '-ffp-contract=off', '-fno-math-errno', '-fno-trapping-math', '-fvisibility=hidden', '-Wall', '-Wextra',
         '-g0']
SANITIZE = ['-O1', '-g', '-fno-omit-frame-pointer', '-fsanitize=address,undefined', '-fno-sanitize-recover=all']


def eigen() -> str:
    """Return the folder of Eigen's headers: of the Python package cmeel-eigen, else of the system."""
    packaged = (pathlib.Path(folder, 'cmeel.prefix/include/eigen3') for folder in sys.path)
    return str(next((folder for folder in packaged if folder.is_dir()), pathlib.Path(sysconfig.get_config_var('INCLUDEDIR'), 'eigen3')))


def flags_wanted() -> tuple[list[str], list[str]]:
    """Return flags for the compiler and for the linker."""
    if os.environ.get('TACTILE_SANITIZE') == '1':
        return FLAGS + SANITIZE, SANITIZE
    return FLAGS + (['-march=native'] if os.environ.get('TACTILE_NATIVE') == '1' else []), []


class BuildKernels(build_ext):
    """Compiles the kernels; all of them anew where the flags are not those of the last time."""

    def build_extension(self, extension):
        """Compile one extension."""
        import pybind11
        from pybind11.setup_helpers import ParallelCompile
        extension.include_dirs += [pybind11.get_include(), eigen()]
        extension.extra_compile_args, extension.extra_link_args = flags_wanted()
        kept = pathlib.Path(self.build_temp) / 'flags'
        flags = ' '.join(extension.extra_compile_args)
        self.force = self.force or not kept.is_file() or kept.read_text() != flags
        with ParallelCompile(default=0):  # a source file on each core
            super().build_extension(extension)
        kept.parent.mkdir(parents=True, exist_ok=True)
        kept.write_text(flags)


def kernels() -> Extension:
    """Return the compiled module: all of src/, a folder for each of the package's subjects."""
    sources, headers = ([str(path) for path in sorted(SOURCE.rglob(kind))] for kind in ('*.cpp', '*.hpp'))
    return Extension(PACKAGE + '._core', sources, depends=headers, include_dirs=[str(SOURCE)], language='c++')


setup(
    name=PACKAGE,
    version='0.1.0',
    packages=find_packages(exclude=['test', 'test.*']),
    ext_modules=[kernels()],
    cmdclass={'build_ext': BuildKernels},
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/' + PACKAGE]),
        ('share/' + PACKAGE, ['package.xml']),
    ],
    install_requires=['setuptools'],
    zip_safe=False,
    maintainer='The tactile authors',
    maintainer_email='tactile@users.noreply.github.com',
    description='What a tactile sensor feels: dots, contact regions, contacts, slip, wrench.',
    license='Apache-2.0',
    entry_points={
        'console_scripts': [
            'dot_tracker_node = tactile_perception.nodes.dot_tracker_node:main',
            'contact_region_node = tactile_perception.nodes.contact_region_node:main',
            'contact_point_node = tactile_perception.nodes.contact_point_node:main',
            'psd_contact_node = tactile_perception.nodes.psd_contact_node:main',
            'taxel_contact_node = tactile_perception.nodes.taxel_contact_node:main',
            'process_bag = tactile_perception.tools.process_bag:main',
            'evaluate = tactile_perception.tools.evaluate:main',
            'calibrate = tactile_perception.tools.calibrate.command:main',
            'convert_recording = tactile_perception.tools.convert.command:main',
        ],
    },
)
