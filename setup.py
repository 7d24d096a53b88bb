# SPDX-License-Identifier: Apache-2.0
"""Install comply_ros where ROS 2 looks for it."""

from glob import glob
import os
from pathlib import Path
from runpy import run_path

from setuptools import find_packages, setup
from setuptools.command.egg_info import egg_info

# Read without importing the package, which needs not be importable where it is built.
TABLES = run_path('comply_ros/executables.py')
EXECUTABLES, EXTRAS = TABLES['EXECUTABLES'], TABLES['EXTRAS']


class CheckMessages(egg_info):
    """The first step of every build; with ROS sourced, it needs the package of the messages."""

    def run(self) -> None:
        prefixes = os.environ.get('AMENT_PREFIX_PATH', '').split(os.pathsep)
        marker = 'share/ament_index/resource_index/packages/comply_msgs'
        if any(prefixes) and not any(Path(prefix, marker).exists() for prefix in prefixes):
            here = Path.cwd()
            raise SystemExit(
                'comply_ros needs its messages, the package comply_msgs, and neither this '
                'workspace nor the sourced ROS has it. Link it beside comply_ros and build '
                f'again:\n  ln -s {here.name}/msg_defs {here.parent}/comply_msgs')
        super().run()


setup(
    name='comply_ros',
    version='0.1.0',
    packages=find_packages(include=('comply_ros', 'comply_ros.*')),
    package_data={'comply_ros': ['maps/*.yaml', 'py.typed']},
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/comply_ros']),
        ('share/comply_ros', ['package.xml']),
        ('share/comply_ros/launch', glob('launch/*.launch.py')),
        ('share/comply_ros/config', glob('config/*.yaml') + glob('config/*.json')),
        ('share/comply_ros/rviz', glob('rviz/*.rviz')),
        ('share/comply_ros/config/security', glob('config/security/*.policy.xml')),
    ],
    python_requires='>=3.11',
    # What comes with ROS (rclpy, messages, launch) is in package.xml alone.
    install_requires=[
        'matplotlib',  # draws the pictures
        'numba',  # compiles the learning loop
        'numpy',
        'Pillow',  # reads the images of Nav2 maps
        'prompt_toolkit',  # reads keys and draws in the terminal of teleop_mentor
        'pydantic',  # checks sweep files and the metadata of bags
        'PyYAML',  # writes parameter files
        'rich',  # shows progress and tables
        'ruamel.yaml',  # reads maps and sweeps, with lines
        'setuptools',
    ],
    extras_require={
        **{name: list(packages.values()) for name, packages in EXTRAS.items()},
        'test': [
            'hypothesis',  # unusual files and messages
            'mcap-ros2-support',  # reads our bags, as other programs do
            'playwright',  # the page in a browser
            'pytest',
        ],
    },
    zip_safe=True,
    license='Apache-2.0',
    description='A robot learns a task from a mentor that may be wrong, and how far to comply.',
    maintainer='The comply_ros maintainers',
    maintainer_email='maintainers@comply-ros.example',
    cmdclass={'egg_info': CheckMessages},
    entry_points={'console_scripts': [
        f'{name} = comply_ros.executables:{name}' for name in EXECUTABLES]},
)
