#!/usr/bin/env bash
# Drives the window of glove-client from outside, with mouse and keys only: opens the menu, reads a
# mesh, grasps it, keeps the shape, saves it, reads it back and compares, exits; then the runs that
# find no display, and a user who clicks anywhere. The window stands in a display without a screen
# (Xvfb), and the processor draws it. Ends with 0 when everything holds, and with 0 and one line
# where a part is missing and cannot be installed.
#
#   BIN_DIR=target/debug tests/window/run.sh     takes a client that is built already
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=tests/window/driving.sh
source tests/window/driving.sh

# -- Meshes: node coordinates of a Gmsh 4.1 file, and how far two files differ

# nodes FILE: tag and coordinates.
nodes() {
    awk '
        /^\$Nodes/ { inside = 1; getline; next }
        /^\$EndNodes/ { exit }
        inside {
            count = $4
            for (i = 0; i < count; i++) { getline; tag[i] = $1 }
            for (i = 0; i < count; i++) { getline; print tag[i], $1, $2, $3 }
        }' "$1" | sort -n
}

# apart FILE FILE: largest distance of a node of one file from the nearest of the other, as a share
# of the longest extent, both brought to the same centre and size. Reading a mesh does that to it,
# and may number its nodes anew.
apart() {
    paste -d ' ' <(nodes "$1") <(nodes "$2") | awk '
        NF != 8 { print "other nodes"; wrong = 1; exit }
        {
            for (i = 0; i < 6; i++) {
                v = $(i < 3 ? i + 2 : i + 3)
                value[NR, i] = v
                if (NR == 1 || v < low[i]) low[i] = v
                if (NR == 1 || v > high[i]) high[i] = v
            }
        }
        END {
            if (wrong) exit
            if (!NR) { print "no nodes"; exit }
            for (i = 0; i < 6; i++) {
                f = i < 3 ? 0 : 1
                if (high[i] - low[i] > size[f]) size[f] = high[i] - low[i]
            }
            for (n = 1; n <= NR; n++)
                for (i = 0; i < 6; i++)
                    value[n, i] = (value[n, i] - (low[i] + high[i]) / 2) / size[i < 3 ? 0 : 1]
            for (n = 1; n <= NR; n++) {
                least = 3
                for (m = 1; m <= NR && least > 0; m++) {
                    sum = (value[n, 0] - value[m, 3]) ^ 2
                    if (sum >= least) continue
                    sum += (value[n, 1] - value[m, 4]) ^ 2 + (value[n, 2] - value[m, 5]) ^ 2
                    if (sum < least) least = sum
                }
                if (least > most) most = least
            }
            printf "%.3e\n", sqrt(most)
        }'
}

# holds CONDITION: arithmetic with fractions.
holds() {
    awk "BEGIN { exit !($1) }"
}

# -- The steps

# Reaches, and closes all fingers with the slider until the object deforms.
grasp() {
    mark
    local at x y width left share try
    at=$(place "close all") || exit 1
    read -r x y width <<<"$at"
    # The knob stands at the left end of the slider.
    left=$((x - width / 2 + 5))
    # A hand that is still being shown how to hold a new object goes there first: asked again, it
    # reaches.
    for try in 1 2 3; do
        click "Reach"
        # The hand is on its way for about two seconds and takes no other wish meanwhile.
        sleep $((2 + 2 * try))
        xdotool mousemove "$left" "$y" mousedown 1
        settle
        for share in 20 30 35 40 45 50 55 60 65 70; do
            xdotool mousemove $((left + (width - 10) * share / 100)) "$y"
            settle 1
            sleep 0.3
            ! new_lines | grep -q 'entered Deforming' || break 2
        done
        xdotool mouseup 1
        settle
    done
    await 'news .*entered Deforming' 20
    # A little further, so that the shape differs plainly.
    xdotool mousemove $((left + (width - 10) * (share + 8) / 100)) "$y"
    settle
    sleep 1
    xdotool mouseup 1
    settle
}

cd "$work"
export XDG_RUNTIME_DIR="$work/runtime"
mkdir -m 700 "$XDG_RUNTIME_DIR"
unset WAYLAND_DISPLAY
"$client" mesh toothpaste --nodes 600 --out toothpaste.msh >/dev/null
open_display

step "the window opens, and the right button opens the menu"
begin main run --hand mouse --object cube --report report.json
menu
xdotool key Escape
settle

step "a name that is no file is refused in a sentence"
menu "Read file …"
write_name nothing.msh
xdotool key Return
await 'notice .*is_refusal=true'
new_lines | grep 'is_refusal=true' | grep -q 'nothing.msh' ||
    fail "the sentence does not name the file"

step "the dialog stays after a refused file: another mesh is read by mouse"
click "toothpaste.msh"
click "Read"
notice "the object is now toothpaste"

step "the hand grasps it by mouse"
grasp

step "the shape is kept"
menu "Keep shape"
notice "shape kept"

step "the shape is saved under a new name"
menu "Save as …"
click "vtu"
click "Save"
notice "saved [^\"]*\.vtu"
compgen -G '*.vtu' >/dev/null || fail "there is no VTU file"
menu "Save as …"
click "msh"
write_name squeezed.msh
click "Save"
notice "saved squeezed.msh"
[ -s squeezed.msh ] || fail "there is no squeezed.msh"
moved=$(apart toothpaste.msh squeezed.msh)
holds "$moved > 1e-3" 2>/dev/null || fail "the kept shape is the old one ($moved apart)"

step "a file is not replaced without a question"
before=$(stat -c '%i %y %s' squeezed.msh)
for answer in "Keep the old one" "Replace"; do
    menu "Save as …"
    write_name squeezed.msh
    click "Save"
    click "$answer"
    if [ "$answer" = Replace ]; then
        notice "saved squeezed.msh"
        [ "$(stat -c '%i %y %s' squeezed.msh)" != "$before" ] || fail "the file was not replaced"
    else
        sleep 2
        alive
        [ "$(stat -c '%i %y %s' squeezed.msh)" = "$before" ] || fail "the file was replaced"
        ! new_lines | grep -q 'notice text="saved' || fail "the file was replaced"
    fi
done

step "a snapshot by key"
mark
xdotool key p
notice "picture written"
compgen -G 'softgrasp*.png' >/dev/null || fail "there is no picture"

step "exit by the menu"
menu "Exit"
ended
for said in '"Deforming"' 'shape kept' 'the object is now toothpaste'; do
    grep -q "$said" report.json || fail "the report does not say: $said"
done

step "what was saved is read back, and is the same"
begin again run --hand mouse --grasp thesis --object cube
menu "Read file …"
click "squeezed.msh"
click "Read"
notice "the object is now squeezed"
menu "Save as …"
write_name once-more.msh
click "Save"
notice "saved once-more.msh"
moved=$(apart squeezed.msh once-more.msh)
holds "$moved < 1e-9" 2>/dev/null || fail "it comes back as another shape ($moved apart)"

step "other sizes of the window, and none"
for size in "300 200" "60 40" "1 1" "1400 900" "800 600"; do
    # shellcheck disable=SC2086
    xdotool windowsize "$window" $size
    sleep 1
    alive
done
xdotool windowunmap "$window"
sleep 2
alive
drawn=$(grep -c 'places: picture=' "$log")
sleep 2
# A picture may have been on its way.
[ $(($(grep -c 'places: picture=' "$log") - drawn)) -le 1 ] ||
    fail "the window is drawn although nobody sees it"
xdotool windowmap "$window"
sleep 1
xdotool windowfocus "$window"
settle
menu "Exit"
ended

step "a user who clicks and types anywhere"
begin hostile run --hand mouse --object cube
RANDOM=1998
keys=(space x Left Right Up Down Prior Next a d q e k ctrl+z BackSpace Home p c t f Return period
    comma w g h l o n F1 F2 F3 F4 Tab Escape shift+t 1 2 3 4 5 ctrl+o ctrl+s Delete ctrl+a shift+1)
end=$((SECONDS + 20))
while [ $SECONDS -lt $end ] && kill -0 "$client_pid" 2>/dev/null; do
    x=$((RANDOM % 1280)) y=$((RANDOM % 800))
    case $((RANDOM % 6)) in
        0) xdotool mousemove $x $y click 1 ;;
        1) xdotool mousemove $x $y click 3 ;;
        2) xdotool mousemove $x $y click $((4 + RANDOM % 2)) ;;
        3) xdotool mousemove $x $y mousedown 1 mousemove $((RANDOM % 1280)) $((RANDOM % 800)) mouseup 1 ;;
        4) xdotool mousemove $x $y mousedown 2 mousemove $((RANDOM % 1280)) $((RANDOM % 800)) mouseup 2 ;;
        5) xdotool key "${keys[RANDOM % ${#keys[@]}]}" ;;
    esac
    sleep 0.05
done
no_panic
# A click may have hit Exit; then the end must have been in order.
end=$((SECONDS + patience))
while kill -0 "$client_pid" 2>/dev/null && [ $SECONDS -lt $end ]; do
    # What is open closes first: in a field for a name, keys are letters.
    xdotool key Escape sleep 1 key ctrl+q sleep 1
done
ended

step "without arguments: the strawberry is squeezed within ten seconds, Ctrl+Q ends"
begin plain
opened=$(grep -F 'places: name="File"' "$log" | head -n 1 | cut -d ' ' -f 1)
told=0
await 'news .*entered Deforming'
squeezed=$(new_lines | grep 'entered Deforming' | head -n 1 | cut -d ' ' -f 1)
took=$(($(date -d "$squeezed" +%s) - $(date -d "$opened" +%s)))
[ $took -le 10 ] || fail "the strawberry was squeezed only after $took s"
xdotool key ctrl+q
ended
grep -q 'strawberry' "$out" || fail "the summary does not name the strawberry"

# -- No window: one sentence, and the run goes on without it

# without NAME ENVIRONMENT...: a run in an environment that has no window.
without() {
    local name="$1" code=0
    shift
    log="$work/without.log"
    timeout $patience env "$@" "$client" run --object cube --nodes 200 \
        --report without.json >without.out 2>"$log" || code=$?
    [ $code = 0 ] || fail "$name: the run ended with $code"
    no_panic
    [ "$(grep -c 'without a window' "$log")" = 1 ] || fail "$name: there is no sentence"
    grep -q '"Deforming"' without.json || fail "$name: nothing was grasped"
    rm -f without.json
}

step "no display: a sentence, and a run without a window"
without "no display" -u DISPLAY -u WAYLAND_DISPLAY
without "a display that is not there" DISPLAY=:9999

step "no graphics driver: a sentence, and a run without a window"
without "no driver" VK_DRIVER_FILES=/nonexistent VK_ICD_FILENAMES=/nonexistent \
    LIBGL_DRIVERS_PATH=/nonexistent __EGL_VENDOR_LIBRARY_FILENAMES=/nonexistent

step "a window that fails although nobody closed it: a sentence, the run goes on, and the exit code is 1"
begin failing run --object cube --hand scripted:release --report failing.json
# Somebody else takes the window away; the display stays.
xdotool windowclose "$window"
ends_with 1
grep -q 'glove-client: .*the run goes on without it' "$log" || fail "there is no sentence"
grep -q 'glove-client: .*this is a fault of the program' "$log" || fail "it is not said to be a fault"
! grep -q 'ended by the user' "$out" || fail "it is said that the user ended it"
grep -q '"Deforming"' failing.json || fail "the run did not go on"

step "the display is lost: a sentence, and the run goes on to its end and its report"
begin lost run --object cube --hand scripted:release --report lost.json
kill_quietly "$display_pid"
display_pid=""
ended
grep -q 'glove-client: .*the run goes on without it' "$log" || fail "there is no sentence"
grep -q '"Deforming"' lost.json || fail "the run did not go on"

say "passed ($SECONDS s)"
