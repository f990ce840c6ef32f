# SPDX-License-Identifier: GPL-3.0-or-later
#
# How tests are run, counted and told: sourced by tests/run.sh and tests/compat/run.sh, which set `pattern`, `logs` and
# `time_limit` (seconds a program).

passed=0
failed=0
skipped=0

report() { # word name
  echo "$1 $2"
  case $1 in
    ok) passed=$((passed + 1)) ;;
    FAIL) failed=$((failed + 1)) ;;
    skip) skipped=$((skipped + 1)) ;;
  esac
}

matches() { [[ $1 == *"$pattern"* ]]; }

# Programs run side by side, as many as there are processors, and are reported in the order in which they were started.
jobs=$(nproc)
started=0
reported=0
prefixes=() stems=() job_logs=()

start() { # prefix stem command...
  local log=$logs/${1//\//_}$2.log
  while [ "$(jobs -rp | wc -l)" -ge "$jobs" ]; do
    wait -n
    report_finished
  done
  prefixes[started]=$1 stems[started]=$2 job_logs[started]=$log
  started=$((started + 1))
  rm -f "$log.code"
  shift 2
  { timeout "$time_limit" "$@" >"$log" 2>&1; echo $? >"$log.code.new"; mv "$log.code.new" "$log.code"; } &
}

report_finished() {
  while [ $reported -lt $started ] && [ -e "${job_logs[reported]}.code" ]; do
    report_program "${prefixes[reported]}" "${stems[reported]}" "${job_logs[reported]}" \
      "$(cat "${job_logs[reported]}.code")"
    reported=$((reported + 1))
  done
}

finish() {
  wait
  report_finished
}

# One test that is a command: passes where the command does.
check() { # name command...
  local name=$1 log=$logs/${1//\//_}.log
  shift
  matches "$name" || return 0
  if timeout "$time_limit" "$@" >"$log" 2>&1; then
    report ok "$name"
  else
    sed 's/^/  /' "$log" | tail -n 100
    report FAIL "$name"
  fi
}

# A program of many tests, which prints "ok NAME", "FAIL NAME" or "skip NAME: why" for each and "end" at last. One that
# prints none of these is a single test, by its exit status.
program() { # prefix stem command...
  start "$1" "$2" env EXM_TEST_PREFIX="$1" "${@:3}"
}

report_program() { # prefix stem log code
  local prefix=$1 stem=$2 log=$3 code=$4 word name
  if ! grep -qE '^(ok|FAIL|skip) |^end$' "$log"; then
    if matches "$prefix$stem"; then
      [ $code -eq 0 ] || sed 's/^/  /' "$log" | tail -n 100
      report "$([ $code -eq 0 ] && echo ok || echo FAIL)" "$prefix$stem"
    fi
    return
  fi
  if grep -q '^FAIL ' "$log"; then
    grep -vE '^(ok|FAIL|skip|end)( |$)' "$log" | tail -n 200
  fi
  while read -r word name; do
    report "$word" "$name"
  done < <(grep -E '^(ok|FAIL|skip) ' "$log")
  # A crash after the last test, a leak, an error that valgrind saw: whatever made it fail without a test saying so.
  if ! grep -q '^end$' "$log" || { [ $code -ne 0 ] && ! grep -q '^FAIL ' "$log"; }; then
    tail -n 60 "$log" | sed 's/^/  /'
    report FAIL "$prefix$stem (exit status $code)"
  fi
}

wanted() { # prefix: could a test of this prefix match the pattern?
  [[ -z $pattern || $1 == *"$pattern"* || $pattern == "$1"* || $pattern != */* ]]
}

# The line that ends a run; the exit status of the runner.
conclude() {
  finish
  [ $skipped -eq 0 ] || echo "$skipped skipped"
  echo "$passed passed, $failed failed"
  [ $failed -eq 0 ]
}
