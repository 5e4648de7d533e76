# What the scripts that drive the window share: the display, the program, its log, mouse and keys.
# To be sourced with bash, in the root of the repository, under `set -euo pipefail`.

here=$(pwd)
# shellcheck source=tests/script.sh
source tests/script.sh window

# -- What it needs

packages=(xvfb mesa-vulkan-drivers libvulkan1 libgl1-mesa-dri libxkbcommon-x11-0 libxcursor1
    libxi6 libxrandr2 xdotool)

missing() {
    local tool
    for tool in Xvfb xdotool; do
        command -v "$tool" >/dev/null || { echo "$tool"; return; }
    done
    compgen -G '/usr/share/vulkan/icd.d/*.json' >/dev/null ||
        compgen -G '/etc/vulkan/icd.d/*.json' >/dev/null || echo "a Vulkan driver"
}

[ -z "$(missing)" ] || install "${packages[@]}"
[ -z "$(missing)" ] ||
    skip "$(missing) is not there and could not be installed (Debian: apt-get install ${packages[*]})"
take_programs glove-client
client="$bin_dir/glove-client"

# -- The folder, the display, and how everything ends

work=$(mktemp -d)
screens=0 display_pid="" client_pid="" log="" step="beginning"

kill_quietly() {
    [ -n "$1" ] || return 0
    kill "$1" 2>/dev/null || return 0
    local n
    for n in $(seq 30); do
        kill -0 "$1" 2>/dev/null || return 0
        sleep 0.1
    done
    kill -9 "$1" 2>/dev/null || true
    wait "$1" 2>/dev/null || true
}

clean_up() {
    kill_quietly "$client_pid"
    kill_quietly "$display_pid"
    cd "$here"
    rm -rf "$work"
}
trap clean_up EXIT
trap 'exit 1' INT TERM

# A picture of the screen that outlives the run, and its log.
picture_of_screen() {
    local file
    file=$(mktemp "${TMPDIR:-/tmp}/window-test-XXXXXX")
    if command -v import >/dev/null && import -window root "png:$file.png" 2>/dev/null; then
        rm -f "$file"
        echo "$file.png"
    elif command -v xwd >/dev/null && xwd -silent -root -out "$file.xwd" 2>/dev/null; then
        rm -f "$file"
        echo "$file.xwd"
    else
        rm -f "$file"
        echo "none (install imagemagick or x11-apps for one)"
    fi
}

fail() {
    # Not on standard output: what a function prints there may be read by the script itself.
    exec >&2
    say "FAILED at: $step: $*"
    if [ -n "$log" ] && [ -f "$log" ]; then
        cp "$log" "${TMPDIR:-/tmp}/window-test.log"
        say "its log is ${TMPDIR:-/tmp}/window-test.log; the last lines:"
        tail -n 25 "$log" | sed 's/^/    /'
    fi
    say "the screen: $(picture_of_screen)"
    exit 1
}

step() {
    step="$1"
    say "$step ($SECONDS s)"
}

# open_display [WIDTHxHEIGHT]
open_display() {
    # An X server begins anew when its last client leaves, and loses who connects meanwhile (7 of 300
    # connections here): not this one.
    Xvfb -displayfd 3 -screen 0 "${1:-1400x900}x24" -nolisten tcp -noreset 3>"$work/display" >/dev/null 2>&1 &
    display_pid=$!
    local n
    for n in $(seq 100); do
        [ -s "$work/display" ] && break
        sleep 0.1
    done
    [ -s "$work/display" ] || fail "Xvfb does not begin"
    DISPLAY=":$(cat "$work/display")"
    export DISPLAY
    : >"$work/display"
}

# -- The program: to begin it, to read its log, to see that it ended

# Seconds that anything may take.
patience=120

# begin NAME ARGUMENT...: opens a window; its log is NAME.log, its output NAME.out.
begin() {
    local name="$1"
    shift
    log="$work/$name.log" out="$work/$name.out" told=0
    RUST_LOG=warn,glove_client=info,softgrasp_hand=info,softgrasp_window=info,softgrasp_window::places=debug NO_COLOR=1 \
        "$client" "$@" >"$out" 2>"$log" &
    client_pid=$!
    local end=$((SECONDS + patience))
    while ! window=$(xdotool search --name '^Softgrasp$' 2>/dev/null | head -n 1) || [ -z "$window" ]; do
        alive
        [ $SECONDS -lt $end ] || fail "no window after $patience s"
        sleep 0.1
    done
    await 'places: name="File"'
    # Nothing else on this display gives the keys to a window.
    xdotool windowfocus "$window"
    # A small window is drawn faster.
    xdotool windowsize "$window" 800 600
    settle 4
}

alive() {
    kill -0 "$client_pid" 2>/dev/null || fail "the program has ended"
}

# From here on the log is new.
mark() {
    told=$(wc -l <"$log")
}

new_lines() {
    tail -n "+$((told + 1))" "$log"
}

# await PATTERN [SECONDS]: until a new line of the log has it.
await() {
    local pattern="$1" limit="${2:-$patience}"
    local end=$((SECONDS + limit))
    until new_lines | grep -qE "$pattern"; do
        alive
        [ $SECONDS -lt $end ] || fail "the log does not say '$pattern' within $limit s"
        sleep 0.1
    done
}

# settle [PICTURES]: waits until so many pictures (two) have been drawn; what was pressed before the
# first is shown by the second. The log tells each picture.
settle() {
    local from pictures="${1:-2}" end=$((SECONDS + patience))
    from=$(wc -l <"$log")
    until [ "$(tail -n "+$((from + 1))" "$log" | grep -c 'places: picture=')" -ge "$pictures" ]; do
        alive
        [ $SECONDS -lt $end ] || fail "the window is not drawn anew within $patience s"
        sleep 0.05
    done
}

# place NAME: centre and width of something that can be clicked, as the log told it last.
place() {
    local line
    line=$(grep -F "places: name=\"$1\" x=" "$log" | tail -n 1) || fail "there is no '$1'"
    sed -E 's/.* x=(-?[0-9]+) y=(-?[0-9]+) width=([0-9]+) .*/\1 \2 \3/' <<<"$line"
}

# click NAME: with the left button.
click() {
    local at x y width
    at=$(place "$1") || exit 1
    read -r x y width <<<"$at"
    xdotool mousemove "$x" "$y" click 1
    [ "$1" = Exit ] || settle 5
}

# menu [ENTRY]: the pop-up menu of the right button, and an entry of it; the log is new from here.
menus=0
menu() {
    # Each time at another place, so that the log tells it again.
    menus=$((menus + 1))
    xdotool mousemove $((450 + menus)) $((200 + 2 * menus))
    settle
    mark
    xdotool click 3
    await 'places: name="Exit"'
    [ -n "${1:-}" ] || return 0
    # A menu is measured before it stands where it stays.
    settle
    click "$1"
    # A dialog is measured before it stands where it stays.
    [ "$1" = Exit ] || settle 5
}

# write_name NAME: into the field of a dialog, in place of what stands there.
write_name() {
    click "file name"
    xdotool key End key --delay 15 --repeat 40 BackSpace
    xdotool type --delay 15 "$1"
    settle
}

# notice PATTERN: the window says so, in a sentence.
notice() {
    await "notice text=\"[^\"]*$1"
}

# ends_with CODE: waits for the end of the program; fails where it ends otherwise.
ends_with() {
    local end=$((SECONDS + patience)) code=0
    while kill -0 "$client_pid" 2>/dev/null; do
        [ $SECONDS -lt $end ] || fail "the program does not end within $patience s"
        sleep 0.1
    done
    wait "$client_pid" || code=$?
    client_pid=""
    [ "$code" = "$1" ] || fail "the program ended with $code, not with $1"
}

# ended: the program ends, and all was in order.
ended() {
    ends_with 0
    no_panic
}

no_panic() {
    ! grep -qE 'panicked|RUST_BACKTRACE' "$log" || fail "the program panicked"
}
