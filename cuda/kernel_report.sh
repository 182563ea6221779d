#!/usr/bin/env bash
# What the compiler says of every kernel: registers, spills, shared memory, and the occupancy that
# follows. Needs nvcc, no GPU. Exits with 1 when a kernel spills.
#
#   cuda/kernel_report.sh [--nvcc NVCC] [--architectures "75 80 86 89 90 120"] OUT.md
set -euo pipefail
cd "$(dirname "$0")/.."
nvcc=$(command -v nvcc || echo /usr/local/cuda/bin/nvcc)
architectures="75 80 86 89 90 120"
out=
while [ $# -gt 0 ]; do
  case $1 in
    --nvcc) nvcc=$2; shift 2 ;;
    --architectures) architectures=$2; shift 2 ;;
    *) out=$1; shift ;;
  esac
done
if [ -z "$out" ]; then
  echo "usage: cuda/kernel_report.sh [--nvcc NVCC] [--architectures LIST] OUT.md" >&2
  exit 2
fi
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
flags="-std=c++20 --expt-relaxed-constexpr -O3 -DNDEBUG -I. -Xptxas -v"

: >"$work/rows"
for architecture in $architectures; do
  for source in cuda/cuda_renderer.cu cuda/cuda_thesis_renderer.cu cuda/photo_shader.cu; do
    "$nvcc" $flags -arch="sm_$architecture" -cubin -o "$work/out.cubin" "$source" \
      2>&1 | c++filt | awk -v architecture="$architecture" -f cuda/kernel_report.awk >>"$work/rows"
  done
done

mkdir -p "$(dirname "$out")"
{
  echo "# The kernels, as the compiler sees them"
  echo
  echo "Made by \`cuda/kernel_report.sh $out\` with $("$nvcc" --version | grep -o 'release [0-9.]*, V[0-9.]*')"
  echo "(\`nvcc $flags -arch=sm_NN -cubin\` of its .cu files). CUB's own kernels are left out."
  echo
  echo "Spills are bytes stored + loaded; stack is the frame in bytes: of calls where the density is not"
  echo "known to the compiler, of the ways down a tree or what a node takes elsewhere. Warps: resident on"
  echo "one multiprocessor, of those it can hold, and what limits them,"
  echo "calculated from registers, shared memory (with the 1 KB a block that the system keeps from 8.0"
  echo "on), threads and blocks."
  echo
  for architecture in $architectures; do
    echo "## sm_$architecture"
    echo
    echo "| kernel | registers | spills | stack | shared memory | warps | limited by |"
    echo "|---|---|---|---|---|---|---|"
    awk -F'\t' -v a="$architecture" '$1 == a { print $2 }' "$work/rows"
    echo
  done
} >"$work/report.md"
mv "$work/report.md" "$out"

if awk -F'\t' '$3 > 0 { found = 1; print "spills: " $2 } END { exit !found }' "$work/rows" >&2; then
  exit 1
fi
