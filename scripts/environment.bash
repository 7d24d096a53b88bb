# SPDX-License-Identifier: Apache-2.0
# Sourced by the scripts beside it: makes what is missing, once, and sets up this shell.
# With a ROS 2 installation sourced it is used; otherwise ROS 2 comes from Python wheels.

set -eu
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
venv=$root/.venv
here=$PWD

say() { printf '%s\n' "$*" >&2; }
fail() { say "comply_ros: $*"; exit 2; }

has_ros() { [ -n "${ROS_DISTRO:-}" ] && [ -n "${AMENT_PREFIX_PATH:-}" ]; }

check_ros() {
  case "$ROS_DISTRO" in
    kinetic | lunar | melodic | noetic | [a-i]*) fail "needs ROS 2 Jazzy or newer, and $ROS_DISTRO is sourced: source a newer one, or" \
            "start a shell without it (then ROS 2 comes from Python wheels)." ;;
  esac
}

is_supported() { "$1" -c 'import sys; sys.exit(not (3, 11) <= sys.version_info < (3, 14))' \
  2>/dev/null; }

find_python() {
  local candidate
  for candidate in ${PYTHON:-python3 python3.13 python3.12 python3.11}; do
    if is_supported "$candidate"; then command -v "$candidate"; return; fi
  done
  fail "needs Python 3.11, 3.12 or 3.13, and ${PYTHON:-python3} is" \
       "$("${PYTHON:-python3}" --version 2>&1 | head -n 1): install one, or name it:" \
       "PYTHON=/path/to/python3.12 $0"
}

# The Python of a ROS installation is the one that has its rclpy.
find_ros_python() {
  local candidate
  for candidate in ${PYTHON:-python3 /usr/bin/python3}; do
    if "$candidate" -c 'import numpy; from rclpy.experimental import EventsExecutor' \
      2>/dev/null; then command -v "$candidate"; return; fi
  done
  fail "found no Python with the rclpy of ROS 2 $ROS_DISTRO, its EventsExecutor and numpy:" \
       "sudo apt upgrade && sudo apt install ros-$ROS_DISTRO-rclpy python3-numpy"
}

check_python() {
  "$1" -c 'import ensurepip, venv' 2>/dev/null || fail "needs the venv module of Python, and" \
    "$1 has none: sudo apt install python3-venv"
  "$1" -c 'import os, sysconfig, sys
sys.exit(not os.path.exists(os.path.join(sysconfig.get_path("include"), "Python.h")))' ||
    fail "needs the headers of Python to build its messages, and those of $1 are missing:" \
         "sudo apt install python3-dev"
}

check_compiler() {
  local tool
  for tool in cmake make c++; do
    command -v "$tool" >/dev/null || fail "needs a C++ compiler, make and CMake to build its" \
      "messages, and '$tool' is missing: sudo apt install build-essential cmake"
  done
}

# What a step was made from; when this text changes, the step is made again.
stamp_of() { cat "$@" | sha256sum | cut -c 1-64; }

sources() { find "$root/msg_defs" "$root/comply_ros" "$root/launch" "$root/config" \
  "$root/resource" "$root/package.xml" "$root/setup.py" "$root/setup.cfg" \
  -type f -not -name '*.pyc' -newer "$1" -print -quit; }

make_venv() {
  local python stamp lists=("$root"/requirements/python.txt "$root"/requirements/test.txt)
  has_ros || lists+=("$root"/requirements/ros.txt)
  stamp=$(stamp_of "${lists[@]}" <(echo "${ROS_DISTRO:-wheels} $root"))
  [ "$stamp" = "$(cat "$venv/made-from" 2>/dev/null)" ] && return
  if has_ros; then python=$(find_ros_python); else python=$(find_python); fi
  check_python "$python"
  check_compiler
  say "Setting up, once ($("$python" --version), ROS 2 ${ROS_DISTRO:-from Python wheels})."
  rm -rf "$venv" "$root/build" "$root/install"
  say '  1/2  Python packages (half a minute) ...'
  if has_ros; then
    "$python" -m venv --system-site-packages "$venv"
    # The installation's own extensions were compiled against its numpy: keep that one.
    "$venv/bin/python" -c 'import numpy; print(f"numpy=={numpy.__version__}")' \
      > "$venv/constraints.txt"
    set -- --constraint "$venv/constraints.txt"
    "$venv/bin/python" -c 'import colcon_core' 2>/dev/null ||
      set -- "$@" "$(grep '^colcon-common-extensions==' "$root/requirements/ros.txt")"
  else
    "$python" -m venv "$venv"
    set -- --no-deps  # all of them are pinned, and pip need not work out whether they fit
  fi
  "$venv/bin/python" -m pip install -qq --disable-pip-version-check "$@" \
    "${lists[@]/#/--requirement=}" >&2 ||
    fail 'could not install its Python packages (see above): is this machine online?'
  echo "$stamp" > "$venv/made-from"
}

build() {
  [ -e "$root/install/made" ] && [ -z "$(sources "$root/install/made")" ] && return
  check_compiler
  say '  2/2  messages and nodes, colcon build (half a minute) ...'
  local begun=$root/build/begun log=$root/build.log
  mkdir -p "$root/build"
  touch "$begun"
  if ! (cd "$root" && python -m colcon build --executor sequential >"$log" 2>&1 9>&-); then
    tail -n 30 "$log" >&2
    fail "colcon build failed; all it said is in $log"
  fi
  rm -f "$log"
  mv "$begun" "$root/install/made"
}

enter() {
  set +u
  # shellcheck disable=SC1091
  . "$venv/bin/activate"
  if ! has_ros; then
    export AMENT_PREFIX_PATH=$venv CMAKE_PREFIX_PATH=$venv
  fi
  build
  . "$root/install/local_setup.bash"
  set -u
}

case "$root" in
  *[[:space:]]*) fail "needs a folder without spaces in its path, which colcon cannot build in," \
                      "got '$root'" ;;
esac
if has_ros; then check_ros; fi
exec 9>"$root/.setup.lock"
flock 9  # of two first runs at the same time, the second waits
make_venv
enter
exec 9>&-
# Nothing leaves this machine unless its user says so.
export ROS_AUTOMATIC_DISCOVERY_RANGE=${ROS_AUTOMATIC_DISCOVERY_RANGE:-LOCALHOST}
cd "$here"
