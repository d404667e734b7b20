# Shared by the scripts in this folder, which source it from the root of the repository. The environment variable POGEMA
# is the path of the program `pogema` [default: the release build, which cargo makes].
pogema=${POGEMA:-}
if [ -z "$pogema" ]; then
    cargo build --quiet --release
    pogema=${CARGO_TARGET_DIR:-target}/release/pogema
fi

# The folder with a folder of suites for each setting.
SUITES=suites

# Plays all suites of a setting, or continues an earlier run: play SETTING MAPS RESULTS [OPTION...]
play() {
    local setting=$1 maps=$2 results=$3 suite name
    shift 3
    for suite in "$SUITES/$setting"/*.yaml; do
        name=$(basename "$suite" .yaml)
        echo "== $setting/$name" >&2
        "$pogema" evaluate "$suite" --maps "$maps" --out "$results/$name" --resume "$@" >&2
    done
}
