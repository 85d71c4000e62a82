#!/bin/bash
# SPDX-License-Identifier: GPL-2.0-or-later
# A seed gives the same packing on every machine: the code that makes packings has no fused multiply-add, which not every
# processor has.
#   check_fused_operations.sh OBJECT...   object files; those that are not named in $exact are passed over
set -euo pipefail
exact='/(packing/packing|geometry/closed_surface|generation/(packing_generator|packing_cleanup|container|compaction))\.cpp\.o$'
checked=0 found=0
for object in "$@"; do
  [[ $object =~ $exact ]] || continue
  checked=$((checked + 1))
  count=$(objdump --disassemble --no-show-raw-insn "$object" | grep -cE '\bv?fn?m(add|sub)' || true)
  echo "$object: $count fused operations"
  ((count == 0)) || found=1
done
((checked == 6)) || { echo "$checked of 6 files were found"; exit 1; }
exit "$found"
