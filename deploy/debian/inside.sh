# Run by deploy/debian/test, as root of a machine that is thrown away; packages lie in /tmp.
checks=0
check() {
  if ! "${@:2}" > /tmp/out 2>&1; then
    cat /tmp/out
    echo "FAIL $1: ${*:2}" >&2
    exit 1
  fi
  checks=$((checks + 1))
}
check_not() { check "$1" bash -c '! "$@"' bash "${@:2}"; }
export DEBIAN_FRONTEND=noninteractive
packages=(/tmp/papilla-server_*-1_amd64.deb /tmp/papilla-server_*-2_amd64.deb)
unit=/lib/systemd/system/papilla-server.service
[ -f "$unit" ] || unit=/usr$unit

# What the unit starts, as its user; its address is in the settings.
start() {
  local command
  command=$(sed -n 's/^ExecStart=//p' "$unit")
  check "its own check passes" setpriv --reuid papilla --regid papilla --clear-groups ${command%% *} check --config /etc/papilla/papilla.toml
  setpriv --reuid papilla --regid papilla --clear-groups --no-new-privs $command > /tmp/start-line 2> /tmp/log &
  service=$!
  for _ in $(seq 600); do
    python3 -c 'import urllib.request as u; u.urlopen("http://127.0.0.1:7224/readyz", timeout=5)' 2> /dev/null && break
    sleep 0.1
  done
  check "it answers" python3 -c '
import json, struct, urllib.request as u
body = struct.pack("<50176f", *(8e3 if 95 <= i // 224 < 115 and 105 <= i % 224 < 130 else 0 for i in range(50176)))
headers = {"content-type": "application/octet-stream", "accept": "application/octet-stream"}
answer = u.urlopen(u.Request("http://127.0.0.1:7224/v1/sed?tier=nano", body, headers), timeout=30).read()
assert max(struct.unpack("<50176f", answer)) > 0'
  check "it runs as its user" [ "$(stat -c %U /proc/$service)" = papilla ]
}
stop() {
  kill -TERM "$service"
  check "it drains" wait "$service"
}

check "install" dpkg -i "${packages[0]}"
check "the user is there" getent passwd papilla
check "and cannot log in" bash -c "getent passwd papilla | grep -q nologin"
check "its folder is its own" [ "$(stat -c %U /var/lib/papilla)" = papilla ]
check "the unit is sound" systemd-analyze verify "$unit"
check "the unit is shut" systemd-analyze security --offline=true --threshold=20 "$unit"
check "the unit starts at boot" [ -L /etc/systemd/system/multi-user.target.wants/papilla-server.service ]
for page in papilla-server.1 papilla-server-check.1; do
  check "man page $page" man --warnings=all -l "/usr/share/man/man1/$page.gz"
done
check "bash completes" bash -c '. /usr/share/bash-completion/completions/papilla-server
  COMP_WORDS=(papilla-server --max-s) COMP_CWORD=1 COMP_LINE="papilla-server --max-s"
  complete=$(complete -p papilla-server); complete=${complete#*-F }
  ${complete%% *} papilla-server --max-s papilla-server; [[ ${COMPREPLY[*]} == *--max-sessions* ]]'
start
stop
echo 'rate_per_s = 500' >> /etc/papilla/papilla.toml

check "upgrade" dpkg -i "${packages[1]}"
check "the newer one is there" bash -c "dpkg-query -W -f '\${Version}' papilla-server | grep -q -- -2"
check "changed settings stay" grep -q '^rate_per_s = 500$' /etc/papilla/papilla.toml
start
stop

check "remove" dpkg -r papilla-server
check_not "the program is gone" test -e /usr/bin/papilla-server
check "settings stay until the purge" test -f /etc/papilla/papilla.toml
check "install again" dpkg -i "${packages[1]}"
check "purge" dpkg -P papilla-server
for path in /etc/papilla /var/lib/papilla /usr/bin/papilla-server "$unit" /etc/systemd/system/multi-user.target.wants/papilla-server.service; do
  check_not "$path is gone" test -e "$path"
done
check_not "the user is gone" getent passwd papilla
echo "checks: $checks"
