# Drives a real window of `glove-client` under Xvfb with xdotool. Read by make.sh, which sets BIN
# (the program), PICTURES (where pictures go) and WORK (a folder that is removed at the end).
#
# The program says on standard error where everything lies that can be clicked, in pixels:
# `name="File" x=46 y=34 …`. These functions read that log; nothing here knows a place beforehand.

WINDOW_LOG=""
WINDOW_PID=""
XVFB_PID=""

# Starts the X server, at a display number that it chooses itself.
start_display() {
    local numbers="$WORK/display"
    : > "$numbers"
    Xvfb -displayfd 3 -screen 0 1280x800x24 -nolisten tcp -noreset 3> "$numbers" 2> "$WORK/xvfb.log" &
    XVFB_PID=$!
    wait_until 20 "the X server" test -s "$numbers"
    DISPLAY=":$(cat "$numbers")"
    export DISPLAY
}

stop_display() {
    if [ -n "$XVFB_PID" ]; then
        kill "$XVFB_PID" 2> /dev/null || true
        wait "$XVFB_PID" 2> /dev/null || true
        XVFB_PID=""
    fi
}

# wait_until SECONDS WHAT COMMAND…: until the command is true.
wait_until() {
    local end=$((SECONDS + $1)) what=$2
    shift 2
    until "$@"; do
        if [ "$SECONDS" -ge "$end" ]; then
            printf 'pictures: waited in vain for %s\n' "$what" >&2
            return 1
        fi
        sleep 0.1
    done
}

# open_window ARGUMENTS…: `glove-client run ARGUMENTS` in the folder WORK/desk, until it is drawn.
open_window() {
    WINDOW_LOG="$WORK/window.log"
    : > "$WINDOW_LOG"
    mkdir -p "$WORK/desk"
    (cd "$WORK/desk" \
        && exec env NO_COLOR=1 RUST_LOG=warn,glove_client=info,softgrasp_hand=info,softgrasp_window=info,softgrasp_window::places=debug \
            "$BIN" run "$@" > "$WORK/window.out" 2> "$WINDOW_LOG") &
    WINDOW_PID=$!
    wait_until 90 "the window" is_told File
    settle
    sleep 2
}

close_window() {
    if [ -n "$WINDOW_PID" ]; then
        kill -INT "$WINDOW_PID" 2> /dev/null || true
        wait "$WINDOW_PID" 2> /dev/null || true
        WINDOW_PID=""
    fi
}

is_told() { grep -q "name=\"$1\" " "$WINDOW_LOG"; }

# Until four more pictures have been shown, which the log counts: the last one knows of everything that
# came before.
settle() {
    local last
    last=$(pictures_shown)
    wait_until 60 "four pictures" pictures_since "$last"
}

pictures_shown() { sed -nE 's/.*places: picture=([0-9]+).*/\1/p' "$WINDOW_LOG" | tail -n 1; }

pictures_since() { [ $(($(pictures_shown) - ${1:-0})) -ge 4 ]; }

# place NAME [SHARE]: where it was told last, its middle, or so many percent along its width.
place() {
    local line x y width share=${2:-50}
    line=$(grep "name=\"$1\" " "$WINDOW_LOG" | tail -n 1)
    x=$(sed 's/.* x=\(-\{0,1\}[0-9]*\) .*/\1/' <<< "$line")
    y=$(sed 's/.* y=\(-\{0,1\}[0-9]*\) .*/\1/' <<< "$line")
    width=$(sed 's/.* width=\([0-9]*\) .*/\1/' <<< "$line")
    printf '%s %s\n' "$((x + (share - 50) * width / 100))" "$y"
}

# click_at BUTTON X Y
click_at() {
    xdotool mousemove "$2" "$3"
    settle
    xdotool mousedown "$1"
    sleep 0.3
    xdotool mouseup "$1"
    settle
}

# area NAME: where it was told last, as a crop of a picture.
area() {
    local line
    line=$(grep "name=\"$1\" " "$WINDOW_LOG" | tail -n 1)
    sed 's/.* x=\(-*[0-9]*\) y=\(-*[0-9]*\) width=\([0-9]*\) height=\([0-9]*\).*/\1 \2 \3 \4/' \
        <<< "$line" | awk '{ printf "%dx%d+%d+%d\n", $3, $4, $1 - $3 / 2, $2 - $4 / 2 }'
}

# Whether the area of NAME looks otherwise than in the picture before.png.
looks_otherwise() {
    local crop before now
    is_told "$1" || return 1
    crop=$(area "$1")
    import -window root "$WORK/now.png"
    before=$(convert "$WORK/before.png" -crop "$crop" +repage gray:- | md5sum)
    now=$(convert "$WORK/now.png" -crop "$crop" +repage gray:- | md5sum)
    [ "$before" != "$now" ]
}

# shows NAME COMMAND…: does something, and waits until the area of NAME looks otherwise. Where the
# processor draws, a picture can come seconds after the click, so nothing else tells.
shows() {
    local name=$1
    shift
    import -window root "$WORK/before.png"
    "$@"
    wait_until 40 "'$name' to be drawn" looks_otherwise "$name"
}

# point NAME [SHARE]: moves the pointer there.
point() {
    wait_until 10 "'$1' to be shown" is_told "$1"
    settle
    local at
    at=$(place "$@")
    # shellcheck disable=SC2086
    xdotool mousemove $at
    settle
}

# click NAME [SHARE]
click() {
    wait_until 10 "'$1' to be shown" is_told "$1"
    settle
    local at
    at=$(place "$@")
    # shellcheck disable=SC2086
    click_at 1 $at
}

# drag X1 Y1 X2 Y2: with the left button, so slowly that no picture misses where it began and ended.
drag() {
    local step
    xdotool mousemove "$1" "$2"
    settle
    xdotool mousedown 1
    settle
    for step in $(seq 5); do
        xdotool mousemove $(($1 + ($3 - $1) * step / 5)) $(($2 + ($4 - $2) * step / 5))
        sleep 0.3
    done
    settle
    xdotool mouseup 1
    settle
}

# slide NAME FROM TO: drags the handle of a slider from one share of its width to another.
slide() {
    local from to
    settle
    from=$(place "$1" "$2")
    to=$(place "$1" "$3")
    # shellcheck disable=SC2086
    drag $from $to
}

# news_count TEXT: how often the grasp has said so.
news_count() { grep -c "text=\"$1\"" "$WINDOW_LOG" || true; }

has_news() { [ "$(news_count "$1")" -ge "$2" ]; }

# await_news SECONDS TEXT [TIMES]
await_news() { wait_until "$1" "'$2'" has_news "$2" "${3:-1}"; }

# screen NAME: the window as it is.
screen() {
    settle
    import -window root "$PICTURES/$1"
}
