#!/bin/sh
# Joins object files into one that keeps its inline functions and their constants to itself: nothing else is linked to
# them, and they are linked to no others.
#   keep_inside.sh LINKER NM OBJCOPY OUTPUT OBJECTS...
set -eu
linker=$1 nm=$2 objcopy=$3 output=$4
shift 4
trap 'rm -f "$output.joined" "$output.inline"' EXIT
"$linker" --relocatable --force-group-allocation -o "$output.joined" "$@"
# V and W: what may be defined in several object files.
"$nm" --defined-only --extern-only --format=posix "$output.joined" | awk '$2 ~ /^[VW]$/ { print $1 }' >"$output.inline"
"$objcopy" --localize-symbols="$output.inline" "$output.joined" "$output"
