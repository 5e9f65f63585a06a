#!/usr/bin/env bash
# That the same bits come out on every machine rests on what is linked. Checks it in the libraries themselves:
# - an object file with compile options of its own defines no inline function, with which the linker could replace another
#   file's;
# - what computes voltages, motions and logs uses no register beyond the baseline's (x86-64: no VEX instruction),
# - and of libm only functions that IEEE 754 rounds in one way.
#   baseline_objects.sh NM OBJDUMP OWN-OBJECTS... -- LIBRARIES...
set -euo pipefail
nm=$1 objdump=$2
shift 2
own=()
while [ "$1" != -- ]; do
  own+=("$1")
  shift
done
shift
failed=0
complain() {
  echo "$1:" >&2
  head -n 20 >&2
  failed=1
}

for object in "${own[@]}"; do
  "$nm" --defined-only --extern-only --format=posix "$object" | awk '$2 !~ /^[VWu]$/ { ++own } END { exit own == 0 }' ||
    { echo "$object offers nothing: is it the object file that is linked?" >&2; failed=1; }
  inline=$("$nm" --defined-only --extern-only --format=posix -C "$object" | grep -E ' [VWu] ' || true)
  [ -z "$inline" ] || complain "$object, with compile options of its own, offers inline functions" <<<"$inline"
done

# Not rounded in one way: what glibc picks by the processor, or may change with a release. (riccati.cpp takes absolute
# values and roots of complex numbers, of which glibc has one variant.)
inexact='^(sin|cos|tan|sincos|asin|acos|atan|atan2|sinh|cosh|tanh|asinh|acosh|atanh|exp|exp2|exp10|expm1|log|log2|log10|log1p|pow|cbrt|hypot|erf|erfc|tgamma|lgamma)[fl]?$'
for library in "$@"; do
  found=$("$nm" --undefined-only -A "$library" | awk '{ print $1, $NF }' |
    awk -v inexact="$inexact" '$2 ~ inexact' || true)
  [ -z "$found" ] || complain "$library takes these functions from libm" <<<"$found"
done
if [ "$(uname -m)" = x86_64 ]; then
  for library in "$@"; do
    members=$("$objdump" -d --no-show-raw-insn "$library" |
      awk '/^[^ ]*\.o: +file format/ { member = $1 } /%[yz]mm|\tv(add|mul|sub|div|fm|fnm|mov|xor)/ { seen[member] = 1 } END { for (m in seen) print m }' |
      grep -vE '_(wide|avx2|avx512)_lanes\.o:' || true)
    [ -z "$members" ] || complain "$library, of which the baseline is asked, has wide instructions in" <<<"$members"
  done
fi
exit "$failed"
