#!/usr/bin/env bash
# Runs the programs of two builds over the same inputs, side by side, and compares all that they write, to the bit:
#   tests/same_bits.sh OLD_BUILD NEW_BUILD                    each difference, then a summary; status 1 when there is one
#   tests/same_bits.sh OLD_BUILD NEW_BUILD --largest-change   the largest change of each number; status 1 when a text changed
# A build is a folder such as build/ci. Times, dates and the software's name are left out; pictures are compared by pixels.
# --keep FOLDER keeps what the programs wrote, in FOLDER/old and FOLDER/new. Real recordings: FIELDTRUE_REAL_DATA.
exec python3 "$(dirname "${BASH_SOURCE[0]}")/same_bits/same_bits.py" "$@"
