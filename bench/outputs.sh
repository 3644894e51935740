#!/usr/bin/env bash
# Stores what every command of the README and the books prints and writes, for
# every shipped sensor, so that two versions can be compared number for number:
#
#     bench/outputs.sh OLD/taxel before && bench/outputs.sh NEW/taxel after
#     diff -r before/numbers after/numbers
#
# Usage: bench/outputs.sh PROGRAM FOLDER [DATA]
# DATA: folder with the sensors' calibration data and recordings (default: this tree).
# FOLDER/texts has the outputs as they are, FOLDER/numbers the numbers in them,
# in their order, one a line, so that words may change and numbers may not.
set -u
here=$(cd "$(dirname "$0")/.." && pwd)
program=$(realpath "$1")
mkdir -p "$2/texts" "$2/numbers" "$2/files"
out=$(realpath "$2")
bench=${3:-$here/crates/taxel-calibrate/data}
recordings=$here/crates/taxel-recording/tests/recordings
cd "$out/files" || exit 1

# A program that leaves existing files alone is told that these are its own.
force=
"$program" check --help | grep -q -e --force && force=--force

# run NAME ARGUMENTS...: standard output, standard error's first lines and exit code.
run() {
    local name=$1
    shift
    case " $* " in *" -o "* | *" --plot "* | *" --report "*) set -- "$@" $force ;; esac
    "$program" "$@" >"$out/texts/$name.out" 2>"$out/texts/$name.err"
    echo "exit $?" >>"$out/texts/$name.out"
}

sensors="in-plane-20um in-plane-50um in-plane-100um three-axis-8x8 three-axis-unit piezo-1.5mm piezo-2.3mm liquid-metal-2x4 eflesh-lattice"
for sensor in $sensors; do
    run "check-$sensor" check "$sensor" --plot "drawing-$sensor.svg"
    run "check-json-$sensor" check "$sensor" --format json
    run "live-$sensor" live "$sensor" --headless --speed max --frames 600 --format json
done
for load in "fx=3 mN, fz=8 mN" "fz=10 mN" "fx=-3 mN, fy=4 mN, fz=12 mN" "fx=1 mN, fz=5 mN"; do
    run "predict-three-axis-8x8-${load// /}" predict three-axis-8x8 --load "$load"
    run "predict-three-axis-unit-${load// /}" predict three-axis-unit --load "$load" --format json
done
for gap in 20 50 100; do
    for load in "fz=10 N" "fz=1 N"; do
        run "predict-in-plane-${gap}um-${load// /}" predict "in-plane-${gap}um" --load "$load" --plot "in-plane-$gap-${load// /}.svg"
    done
done
run predict-in-plane-fem predict in-plane-50um --load "fz=10 N" --mechanics fem
for thick in 1.5 2.3; do
    for load in "profile=impact, fz=200 mN, ramp=10 ms, dwell=200 ms" "profile=step, fz=200 mN, ramp=10 ms, dwell=200 ms"; do
        run "predict-piezo-${thick}mm-$(echo "$load" | tr -d ' ,=')" predict "piezo-${thick}mm" --load "$load"
    done
done
for p in "15 kPa" "5 kPa" "25 kPa"; do
    run "predict-liquid-metal-${p// /}" predict liquid-metal-2x4 --load "p=$p" --plot "liquid-$p.svg"
done
run predict-liquid-metal-fem predict liquid-metal-2x4 --load "p=15 kPa" --mechanics fem
for source in finger; do run "live-sim-$source" live three-axis-8x8 --source "sim:$source" --headless --speed max --frames 1500 --format json; done
run live-sim-press live in-plane-50um --source sim:press --headless --speed max --frames 1500 --format json
for s in piezo-tap piezo-press piezo-slide; do run "live-$s" live piezo-1.5mm --source "sim:$s" --headless --speed max --frames 20000 --format json; done
for s in pad-a pad-b pad-c pad-d pad-e; do run "live-$s" live liquid-metal-2x4 --source "sim:$s" --headless --speed max --frames 3000 --format json; done
for r in fingertip.csv insoles.csv foot.asf; do
    run "replay-$r" live --source "replay:$recordings/$r" --headless --speed max --format json
done
run calibrate-in-plane calibrate in-plane-50um "$bench/in-plane-synthetic.csv" --with in-plane-20um --with in-plane-100um -o in-plane.toml --report in-plane.html
for sensor in in-plane-50um three-axis-unit three-axis-8x8 piezo-1.5mm liquid-metal-2x4; do
    run "twin-$sensor" twin "$sensor" --calibration-data -o "twin-$sensor.csv"
    run "calibrate-twin-$sensor" calibrate "$sensor" "twin-$sensor.csv" -o "twin-$sensor.toml" --report "twin-$sensor.html"
done
run sweep sweep p4-sections -o sections.csv --plot sections.svg
run verify verify --short
run reproduce reproduce -o report.html
run schema schema sensor
run reference schema reference
run schema-stimulus schema stimulus

# Times of this run, commits and hashes are no results.
for file in "$out"/texts/*.out "$out"/files/*; do
    sed -E '/"commit"|"p[0-9._]+"|"largest"|"duration_s"|"rate_hz"|"elapsed|"source"|commit <code>/d; s/unknowns, [0-9.]+ s//; s/0\.1\.0 \(?[0-9a-f]{12}//g; s/[0-9a-f]{16,}//g' "$file" |
        grep -oE '[-+]?[0-9]+(\.[0-9]+)?([eE][-+]?[0-9]+)?' >"$out/numbers/$(basename "$file")"
done
