#!/usr/bin/env bash
# The benchmarks against their peers, without timing: same results, or it ends with 1.
# Installs NumPy, SciPy and mpmath into a virtual environment unless PYTHON names a
# Python that has them.
set -euo pipefail
cd "$(dirname "$0")"
if [ -z "${PYTHON:-}" ]; then
    environment=../target/bench/peers
    if ! [ -x "$environment/bin/python" ]; then
        python3 -m venv "$environment" || {
            command -v apt-get >/dev/null && apt-get install -y -qq --no-install-recommends python3-venv >/dev/null
            python3 -m venv "$environment"
        }
    fi
    "$environment/bin/pip" install --quiet --disable-pip-version-check numpy scipy mpmath
    PYTHON=$(realpath -s "$environment/bin/python")
    export PYTHON
fi
# All of the workspace's features and, for the sake of a benchmark, those of its tests: what is
# built here is what `cargo test --workspace` builds.
cargo build --quiet --locked --workspace --bin compare --bin calibrate --bin predict --bin chain \
    --bench estimator --bench observer --bench trained
for name in compare calibrate predict chain; do
    echo "-- $name"
    "../target/debug/$name" --agree
done
