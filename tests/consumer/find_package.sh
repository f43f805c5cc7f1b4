#!/bin/sh
# find_package.sh PROJECT PREFIX BUILD CMAKE: builds and runs the project against the installed package.
set -eu
rm -rf "$3"
"$4" -S "$1" -B "$3" -G Ninja -DCMAKE_PREFIX_PATH="$2" -DCMAKE_FIND_USE_PACKAGE_REGISTRY=OFF
"$4" --build "$3"
"$3/consumer"
