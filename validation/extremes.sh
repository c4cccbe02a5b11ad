#!/usr/bin/env bash
# The comparison that extremes/README.md sums up, a row for each case, as Markdown: ./bootstrap bash validation/extremes.sh [FAMILY]
# `reference [FAMILY]` in its place computes anew what the tables are measured against, validation/extremes/references.dat.

set -eu
cd -- "$(dirname -- "${BASH_SOURCE[0]}")"
export LC_ALL=C OPENBLAS_NUM_THREADS=1
exec fpm run extremes --profile release -- "$@"
