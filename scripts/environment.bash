# SPDX-License-Identifier: Apache-2.0
# Sourced by the scripts beside it: installs and builds what is missing, then sets up this shell.
# A sourced ROS 2 installation is used; without one, ROS 2 comes from Python wheels.
# A second start takes some ten milliseconds: it starts no process but `find`.

set -eu
here=$PWD
CDPATH='' cd "${BASH_SOURCE[0]%/*}/.."
root=$PWD
venv=$root/.venv
install=$root/install
CDPATH='' cd "$here"

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

# What the virtual environment is made from; when this text changes, it is made again.
read_recipe() {
  local list
  lists=("$root"/requirements/python.txt "$root"/requirements/test.txt)
  has_ros || lists+=("$root"/requirements/ros.txt)
  recipe="ROS 2 ${ROS_DISTRO:-wheels} in $root"
  for list in "${lists[@]}"; do recipe+=$'\n'$(<"$list"); done
}

has_venv() { [ -e "$venv/made-from" ] && [ "$recipe" = "$(<"$venv/made-from")" ]; }

has_build() {
  [ -e "$install/made" ] && [ -z "$(find "$root/msg_defs" "$root/comply_ros" "$root/launch" \
    "$root/config" "$root/resource" "$root/package.xml" "$root/setup.py" "$root/setup.cfg" \
    -type f -not -name '*.pyc' -newer "$install/made" -print -quit)" ]
}

has_variables() {
  local packages=("$venv"/lib/python*/site-packages)  # another wheel may bring other libraries
  [ "$install/variables" -nt "$install/local_setup.bash" ] &&
    ! [ "${packages[0]}" -nt "$install/variables" ]
}

# colcon would leave modules and executables installed that were deleted or renamed.
has_deleted_modules() {
  local installed=("$install"/comply_ros/lib/python*/site-packages/comply_ros)
  [ -d "${installed[0]}" ] && [ -n "$(cd "${installed[0]}" && find . -name '*.py' \
    -exec test ! -e "$root/comply_ros/{}" \; -print -quit)" ]
}

make_venv() {
  local python
  if has_ros; then python=$(find_ros_python); else python=$(find_python); fi
  check_python "$python"
  check_compiler
  say "Setting up, once ($("$python" --version), ROS 2 ${ROS_DISTRO:-from Python wheels})."
  rm -rf "$venv" "$root/build" "$install"
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
    set -- --no-deps  # all of them are pinned, so pip need not check whether they fit
  fi
  "$venv/bin/python" -m pip install -qq --disable-pip-version-check "$@" \
    "${lists[@]/#/--requirement=}" >&2 ||
    fail 'could not install its Python packages (see above): is this machine online?'
  printf '%s\n' "$recipe" > "$venv/made-from"
}

make_build() {
  check_compiler
  say '  2/2  messages and nodes, colcon build (half a minute) ...'
  local started=$root/build/started log=$root/build.log
  mkdir -p "$root/build"
  touch "$started"
  if has_deleted_modules; then rm -rf "$root/build/comply_ros" "$install/comply_ros"; fi
  if ! (cd "$root" && python -m colcon build --executor sequential >"$log" 2>&1 9>&-); then
    tail -n 30 "$log" >&2
    fail "colcon build failed; its whole output is in $log"
  fi
  rm -f "$log"
  mv "$started" "$install/made"
}

# Writes what `local_setup.bash` sets to a file, since it takes a tenth of a second each time.
# Python reads the values: the wheels of ROS 2 add their libraries when it starts. With the last
# line (`guard`) later Pythons know that this is done; otherwise each would start a second time.
make_variables() (
  local paths=(AMENT_PREFIX_PATH CMAKE_PREFIX_PATH COLCON_PREFIX_PATH LD_LIBRARY_PATH PYTHONPATH)
  local guard=_ROS_WHEELS_BOOTSTRAP_COMPLETE
  unset "${paths[@]}" "$guard"
  set +u
  # shellcheck disable=SC1091
  . "$install/local_setup.bash"
  python -c 'import os, shlex, sys
*paths, guard = sys.argv[1:]
for name in paths:
    if value := os.environ.get(name, "").strip(":"):
        print("prepend", name, shlex.quote(value))
print(f"export {guard}=1" if guard in os.environ else "")' \
    "${paths[@]}" "$guard" > "$install/variables.new"
  mv "$install/variables.new" "$install/variables"
)

# Puts paths in front of a variable, unless they are there.
prepend() { [[ ${!1-}: == "$2:"* ]] || export "$1=$2${!1:+:${!1}}"; }

# Starts an executable. The installed script would first search for its entry point, for 50 ms.
start() {
  exec python -P -c "import sys; from comply_ros.executables import $1 as main
sys.argv[0] = '$1'; sys.exit(main())" "${@:2}"
}

enter_venv() {
  export VIRTUAL_ENV=$venv
  unset PYTHONHOME
  prepend PATH "$venv/bin"
  has_ros || export AMENT_PREFIX_PATH=$venv CMAKE_PREFIX_PATH=$venv
}

case "$root" in
  *[[:space:]]*) fail "needs a folder without spaces in its path, which colcon cannot build in," \
                      "got '$root'" ;;
esac
if has_ros; then check_ros; fi
read_recipe
if ! { has_venv && has_build && has_variables; }; then
  exec 9>"$root/.setup.lock"
  flock 9  # of two first runs at the same time, the second waits
  has_venv || make_venv
  enter_venv
  has_build || make_build
  has_variables || make_variables
  exec 9>&-
fi
enter_venv
# shellcheck disable=SC1091
. "$install/variables"
# Nothing leaves this machine unless its user says so.
export ROS_AUTOMATIC_DISCOVERY_RANGE=${ROS_AUTOMATIC_DISCOVERY_RANGE:-LOCALHOST}
