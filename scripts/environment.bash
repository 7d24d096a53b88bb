# SPDX-License-Identifier: Apache-2.0
# Sourced by the scripts beside it: installs and builds what is missing, then sets up this shell.
# A sourced ROS 2 installation is used; without one, ROS 2 comes from Python wheels. Each has a
# virtual environment and a build of its own, so that a shell with ROS and one without it do not
# disturb each other.
# A second start takes some ten milliseconds: it starts no program but `readlink`,
# `dirname`, `flock` and `find`.

set -eu
# What a user's shell may have exported must not change what the lines below mean.
set +o noglob +o noclobber +o allexport +o posix
shopt -u failglob nullglob dotglob nocaseglob nocasematch
unset CDPATH GLOBIGNORE PYTHONHOME PYTHONPLATLIBDIR PYTHONEXECUTABLE
unset -f cd command env find flock grep make mkdir mv python readlink rm stat tail touch || true

case "${BASH_SOURCE[0]}" in
  */*) root=$(cd -P "${BASH_SOURCE[0]%/*}/.." && pwd) ;;  # links are followed: one set-up a clone
  *) root=$(cd -P .. && pwd) ;;
esac

say() { printf '%s\n' "$*" >&2; }
fail() { say "comply_ros: $*"; exit 2; }

# ROS 2 is sourced if the variables name a prefix that has rclpy: images of Docker set ROS_DISTRO
# in every shell, and the wheels' prefix is ours.
has_ros() {
  [ -n "${ROS_DISTRO:-}" ] || return 1
  local prefix prefixes
  IFS=: read -r -a prefixes <<< "${AMENT_PREFIX_PATH:-}"
  for prefix in "${prefixes[@]}"; do
    [[ $prefix == "$root"/* ]] ||
      ! [ -e "$prefix/share/ament_index/resource_index/packages/rclpy" ] || return 0
  done
  return 1
}

check_folder() {
  local letters=abcdefghijklmnopqrstuvwxyz  # not a-z, which depends on the locale
  if [[ $root == *[!$letters${letters^^}0123456789/._+@~-]* ]]; then
    fail "needs a folder whose path has only the letters a to z, digits and ._-+@~ (colcon and" \
         "CMake cannot build in others), got '$root'"
  fi
}

check_ros() {
  case "$ROS_DISTRO" in
    kinetic | lunar | melodic | noetic | [a-i]*) fail "needs ROS 2 Jazzy or newer, and $ROS_DISTRO is sourced: source a newer one, or" \
            "start a shell without it (then ROS 2 comes from Python wheels)." ;;
  esac
}

# Runs a program of the set-up in the root folder without the user's settings of Python, pip,
# colcon, CMake and make. What remains says where programs, packages and the network are.
clean() (
  local name kept=(LC_ALL=C.UTF-8 "PATH=$venv/bin:$PATH" "VIRTUAL_ENV=$venv")
  local names=(HOME USER LOGNAME TMPDIR XDG_CACHE_HOME XDG_CONFIG_HOME XDG_CONFIG_DIRS
    SSL_CERT_FILE SSL_CERT_DIR REQUESTS_CA_BUNDLE CURL_CA_BUNDLE CC CXX
    {http,https,all,no}_proxy {HTTP,HTTPS,ALL,NO}_PROXY "${!PIP_@}")
  if has_ros; then
    names+=(PYTHONPATH LD_LIBRARY_PATH AMENT_PREFIX_PATH CMAKE_PREFIX_PATH COLCON_PREFIX_PATH
      ROS_DISTRO ROS_VERSION ROS_PYTHON_VERSION)
  else
    kept+=("AMENT_PREFIX_PATH=$venv" "CMAKE_PREFIX_PATH=$venv")
  fi
  for name in "${names[@]}"; do
    [ -z "${!name+set}" ] || kept+=("$name=${!name}")
  done
  cd "$root"
  exec env -i "${kept[@]}" "$@"
)

absolute() { local path; path=$(command -v "$1") && case "$path" in
  /*) echo "$path" ;;
  *) echo "$PWD/$path" ;;
esac; }

is_supported() { clean "$1" -c 'import sys; sys.exit(not (3, 11) <= sys.version_info < (3, 14))' \
  2>/dev/null; }

find_python() {
  local candidate path
  for candidate in ${PYTHON:-python3 python3.13 python3.12 python3.11}; do
    if path=$(absolute "$candidate") && is_supported "$path"; then echo "$path"; return; fi
  done
  fail "needs Python 3.11, 3.12 or 3.13, and ${PYTHON:-python3} is" \
       "$("${PYTHON:-python3}" --version 2>&1 | head -n 1): install one, or name it:" \
       "PYTHON=/path/to/python3.12 $0"
}

# The Python of a ROS installation is the one that has its rclpy.
find_ros_python() {
  local candidate path
  for candidate in ${PYTHON:-python3 /usr/bin/python3}; do
    if path=$(absolute "$candidate") &&
      clean "$path" -c 'import numpy; from rclpy.experimental import EventsExecutor' \
      2>/dev/null; then echo "$path"; return; fi
  done
  fail "found no Python with the rclpy of ROS 2 $ROS_DISTRO, its EventsExecutor and numpy:" \
       "sudo apt upgrade && sudo apt install ros-$ROS_DISTRO-rclpy python3-numpy"
}

check_python() {
  clean "$1" -c 'import ensurepip, venv' 2>/dev/null || fail "needs the venv module of Python," \
    "and $1 has none: sudo apt install python3-venv"
  clean "$1" -c 'import os, sysconfig, sys
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

# Three stamps say what was made and from what. Each is removed before that changes, and written
# last, so that a set-up that was interrupted is done again:
#   $venv/made-from     the lists of packages, and where; with `test` etc. added to it
#   $install/made-from  the sources, with their sizes and times
#   $install/variables  what `local_setup.bash` sets

# What the virtual environment is made from; when this text changes, it is made again.
read_recipe() {
  local list
  lists=("$root/requirements/python.txt")
  has_ros || lists+=("$root/requirements/ros.txt")
  recipe="${suffix:-wheels} in $root"
  for list in "${lists[@]}"; do recipe+=$'\n'$(<"$list")$'\n'"(${list##*/})"; done
}

is_stamp() { [ -r "$1" ] && [ "$2" = "$(<"$1")" ]; }

write_stamp() { printf '%s\n' "$2" > "$1.new" && mv "$1.new" "$1"; }

has_venv() { [ -x "$venv/bin/python" ] && is_stamp "$venv/made-from" "$recipe"; }

list_sources() { (cd "$root" && find msg_defs comply_ros launch config resource rviz \
  package.xml setup.py setup.cfg -type f -not -name '*.pyc' -printf '%p %s %T@\n' \
  2>/dev/null) || true; }

has_build() {
  [ -e "$install/local_setup.bash" ] && is_stamp "$install/made-from" "$(list_sources)"
}

has_variables() {
  local packages=("$venv"/lib/python*/site-packages)  # another wheel may bring other libraries
  [ "$install/variables" -nt "$install/local_setup.bash" ] &&
    ! [ "${packages[0]}" -nt "$install/variables" ]
}

is_set_up() { has_venv && has_build && has_variables; }

# colcon would leave modules and executables installed that were deleted or renamed.
has_deleted_modules() {
  local installed=("$install"/comply_ros/lib/python*/site-packages/comply_ros)
  [ -d "${installed[0]}" ] && [ -n "$(cd "${installed[0]}" && find . -name '*.py' \
    -exec test ! -e "$root/comply_ros/{}" \; -print -quit)" ]
}

install_packages() {
  clean "$venv/bin/python" scripts/install_packages.py "$@" >&2 || fail 'could not install its' \
    'Python packages, for the reason above; if that is the network, go online and start again.'
}

make_venv() {
  local python options=(--no-deps)  # all of them are pinned: pip need not check whether they fit
  if has_ros; then python=$(find_ros_python); else python=$(find_python); fi
  check_python "$python"
  check_compiler
  say "Setting up, once ($(clean "$python" --version), ROS 2 ${suffix:-from Python wheels})."
  rm -f "$venv/made-from" "$install/made-from" "$install/variables"
  rm -rf "$venv" "$build" "$install"
  say '  1/2  Python packages (half a minute) ...'
  if has_ros; then
    clean "$python" -m venv --system-site-packages "$venv"
    # The installation's own extensions were compiled against its numpy: keep that one.
    clean "$venv/bin/python" -c 'import numpy; print(f"numpy=={numpy.__version__}")' \
      > "$venv/constraints.txt"
    options=(--constraint "$venv/constraints.txt")
    clean "$venv/bin/python" -c 'import colcon_core' 2>/dev/null ||
      options+=("$(grep '^colcon-common-extensions==' "$root/requirements/ros.txt")")
  else
    clean "$python" -m venv "$venv"
  fi
  install_packages "${options[@]}" "${lists[@]/#/--requirement=}"
  write_stamp "$venv/made-from" "$recipe"
}

# Adds the packages of lists that only developers need: `add_packages test` for test.txt.
add_packages() {
  local name list wanted='' options=()
  local files=()
  for name in "$@"; do files+=("$root/requirements/$name.txt"); done
  for list in "${files[@]}"; do wanted+=$(<"$list")$'\n'; done
  wanted=${wanted%$'\n'}
  if is_stamp "$venv/added-$1" "$wanted"; then return; fi
  [ -w "$venv" ] || fail "has no packages for '$1' yet, and you may not write in $venv:" \
    "start this script once as its owner ($(stat -c %U "$venv"))"
  if has_ros; then options=(--constraint "$venv/constraints.txt"); else options=(--no-deps); fi
  say "Installing the packages of requirements/$1.txt, once ..."
  rm -f "$venv/added-$1"
  install_packages "${options[@]}" "${files[@]/#/--requirement=}"
  write_stamp "$venv/added-$1" "$wanted"
}

make_build() {
  check_compiler
  say '  2/2  messages and nodes, colcon build (a minute) ...'
  local sources log=$root/build.log
  sources=$(list_sources)
  rm -f "$install/made-from" "$install/variables"
  if has_deleted_modules; then rm -rf "$build/comply_ros" "$install/comply_ros"; fi
  mkdir -p "$build/colcon"
  # Not the user's ~/.colcon, and none of the links that one of its options would make. On a busy
  # machine make would compile one file at a time: colcon limits it by the load.
  if ! clean env COLCON_HOME="$build/colcon" COLCON_DEFAULTS_FILE="$build/colcon/none" \
    MAKEFLAGS="-j$(nproc)" \
    "$venv/bin/python" -m colcon --log-base "$root/log" build --executor sequential \
    --base-paths . msg_defs --build-base "$build" --install-base "$install" >"$log" 2>&1; then
    tail -n 30 "$log" >&2
    fail "colcon build failed; its whole output is in $log"
  fi
  rm -f "$log"
  write_stamp "$install/made-from" "$sources"
}

# Writes what `local_setup.bash` sets to a file, since it takes a tenth of a second each time.
# Python reads the values: the wheels of ROS 2 add their libraries when it starts. With the last
# line (`guard`) later Pythons know that this is done; otherwise each would start a second time.
# The wheels' folder is in PYTHONPATH too, before what else is there: packages of ROS 1 have the
# same names.
make_variables() {
  local packages=("$venv"/lib/python*/site-packages)
  if has_ros; then packages=(); fi
  # shellcheck disable=SC2016
  clean bash -c '
paths=(AMENT_PREFIX_PATH CMAKE_PREFIX_PATH COLCON_PREFIX_PATH LD_LIBRARY_PATH PYTHONPATH)
unset "${paths[@]}"
[ -z "$3" ] || export PYTHONPATH=$3
. "$2/local_setup.bash"
exec "$1/bin/python" -c "import os, shlex, sys
*paths, guard = sys.argv[1:]
for name in paths:
    if value := os.environ.get(name, str()).strip(chr(58)):
        print(\"prepend\", name, shlex.quote(value))
print(f\"export {guard}=1\" if guard in os.environ else str())" \
  "${paths[@]}" _ROS_WHEELS_BOOTSTRAP_COMPLETE' \
    bash "$venv" "$install" "${packages[0]:-}" > "$install/variables.new"
  mv "$install/variables.new" "$install/variables"
}

# Puts paths in front of a variable, unless they are there.
prepend() { [[ ${!1-}: == "$2:"* ]] || export "$1=$2${!1:+:${!1}}"; }

# Starts an executable. The installed script would first search for its entry point, for 50 ms.
start() {
  unset PYTHONINSPECT  # the executables are no place to go on in
  exec python -P -c "import sys; from comply_ros.executables import $1 as main
sys.argv[0] = '$1'; sys.exit(main())" "${@:2}"
}

# Starts a module of the folder `tools`, which is not installed.
start_tool() {
  unset PYTHONINSPECT
  prepend PYTHONPATH "$root"
  exec python -P -m tools "$@"  # -P: not a folder `tools` of where the user is
}

enter_venv() {
  export VIRTUAL_ENV=$venv
  prepend PATH "$venv/bin"
  has_ros || export AMENT_PREFIX_PATH=$venv CMAKE_PREFIX_PATH=$venv
}

list_lock_holders() {
  local process file
  for process in /proc/[0-9]*; do
    for file in "$process"/fd/*; do
      if [ "$file" -ef "$in_use" ]; then echo "${process#/proc/}"; break; fi
    done
  done
}

# Waits for the lock, alone: a script holds it, shared, as long as its program runs.
claim() {
  local users
  if [ -n "${use:-}" ]; then return; fi
  exec {use}>>"$in_use"
  # Programs that no script has started have a library loaded.
  users=$(grep -lsF -e "$1/" /proc/[0-9]*/maps | grep -o '[0-9]*' || true)
  if ! flock --exclusive --timeout 3 "$use"; then
    exec {use}>&-
    users+=$'\n'$(list_lock_holders)
  fi
  users=$(sort -nu <<< "$users" | tr '\n' ' ')
  users=${users# }
  [ -z "${users// /}" ] || fail "has to be set up again, since its files have changed, and something" \
    "still runs from $root: end it first (process ${users% })"
}

# Whether a build replaces or deletes what a running program may have open.
is_disturbing() {
  has_deleted_modules || [ "$(list_sources | grep ^msg_defs/)" != \
    "$(grep -s ^msg_defs/ "$install/made-from")" ]
}

set_up() {
  local setup
  if ! [ -w "$root" ] && is_stamp "$venv/made-from" "$recipe" && ! [ -x "$venv/bin/python" ]; then
    fail "is set up in $root with a Python that you may not start," \
      "$(readlink "$venv/bin/python"): use a clone of your own"
  fi
  [ -w "$root" ] || fail "is not set up in $root for its present files, and you may not write" \
    "there: start a script once as its owner ($(stat -c %U "$root")), or use a clone of your own"
  exec {setup}>>"$root/.setup.lock"
  flock "$setup"  # of two first runs at the same time, the second waits
  if ! has_venv; then
    if [ -e "$venv" ]; then claim "$venv"; fi
    make_venv
  fi
  if ! has_build; then
    if is_disturbing; then claim "$install/comply_msgs"; fi
    make_build
  fi
  has_variables || make_variables
  [ -n "${use:-}" ] || exec {use}>>"$in_use"
  flock --shared "$use"
  exec {setup}>&-
}

if has_ros; then check_ros; suffix=$ROS_DISTRO; else suffix=''; fi
venv=$root/.venv${suffix:+-$suffix}
build=$root/build${suffix:+-$suffix}
install=$root/install${suffix:+-$suffix}
in_use=$root/.in-use.lock
check_folder
read_recipe
if [ -r "$in_use" ]; then
  exec {use}<"$in_use"
  flock --shared "$use" || true  # on a file system without locks
fi
if ! is_set_up; then
  [ -z "${use:-}" ] || exec {use}<&-
  unset use
  set_up
fi
enter_venv
# shellcheck disable=SC1091
. "$install/variables"
# Nothing leaves this machine unless its user says so.
export ROS_AUTOMATIC_DISCOVERY_RANGE=${ROS_AUTOMATIC_DISCOVERY_RANGE:-LOCALHOST}
