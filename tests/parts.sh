# Sourced by the test scripts: what happens to a part that cannot run here, for want of a package, a network
# or a display. On a person's machine it is left out, and that is said. Where CI=true it fails: a part of CI
# that did not run has not passed.

# left_out REASON...: says so, or ends the script.
left_out() {
  if [ "${CI:-}" = true ]; then
    echo "FAILED: a part of CI cannot run here: $*"
    exit 1
  fi
  echo "left out: $*"
}
