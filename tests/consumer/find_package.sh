#!/bin/sh
# find_package.sh PROJECT PREFIX BUILD CMAKE PROGRAM [ARGUMENT...]: builds the project against the installed package
# and runs its program.
set -eu
project=$1 prefix=$2 build=$3 cmake=$4 program=$5
shift 5
rm -rf "$build"
"$cmake" -S "$project" -B "$build" -G Ninja -DCMAKE_PREFIX_PATH="$prefix" -DCMAKE_FIND_USE_PACKAGE_REGISTRY=OFF
"$cmake" --build "$build"
"$build/$program" "$@"
