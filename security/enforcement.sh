#!/usr/bin/env bash
# Tries the policy for real, with a Fast DDS that is built with security.
#
#     security/enforcement.sh [PREFIX]
#
# PREFIX holds include/ and lib/ of Fast DDS 2.x (default /usr: apt install libfastrtps-dev g++).
# Prints what each enclave may do, and fails if that is not what the policy is for.
set -euo pipefail

here=$(dirname -- "$(readlink -f -- "${BASH_SOURCE[0]}")")
prefix=${1:-/usr}
multi=$(uname -m)-linux-gnu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
domain=$((100 + $$ % 100))

libraries=$prefix/lib/$multi
c++ -std=c++17 -O1 -w -I"$prefix/include" -I"$prefix/include/$multi" \
  "$here/enforcement.cpp" -o "$work/enforcement" \
  -L"$libraries" -Wl,-rpath-link,"$libraries" -lfastrtps -lfastcdr -lpthread
export LD_LIBRARY_PATH=$libraries${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH}

policy=$here/policies/trajectory_guard.policy.xml
for keys in keys forged; do  # the same names, but another authority
  python3 "$here/keystore.py" "$policy" "$work/$keys" --domain "$domain"
done

controller=rt/joint_trajectory_controller/joint_trajectory
request=rq/guard/certifyRequest
reply=rr/guard/certifyReply

pids=()
# Starts a participant: its name, its keys, what it tries.
join() {
  "$work/enforcement" "$2" "$domain" 8 "${@:3}" >"$work/$1.log" 2>&1 &
  pids+=($!)
}
# Prints what came of it, and fails unless it is what is expected.
expect() {
  grep -E '^(pub|sub) ' "$work/$1.log" >"$work/$1.out" || true
  sed "s/^/$1: /" "$work/$1.out"
  diff <(printf '%s\n' "${@:2}") "$work/$1.out" >&2 || failed=1
}

failed=0
enclaves=$work/keys/enclaves
echo '# among themselves'
join controller "$enclaves/controller" "sub:$controller"
join guard "$enclaves/trajectory_guard/guard" "sub:$request" "pub:$reply"
join gate "$enclaves/trajectory_guard/gate" "pub:$controller" "pub:$request" "sub:$reply" \
  sub:rt/gate/trajectory
join planner "$enclaves/planner" "pub:$controller" "pub:$request" pub:rt/gate/trajectory \
  pub:rt/joint_states pub:rt/guard/scene pub:rq/guard/set_parametersRequest
wait "${pids[@]}"
expect controller "sub $controller works"
expect guard "sub $request works" "pub $reply works"
expect gate "pub $controller works" "pub $request works" "sub $reply works" \
  'sub rt/gate/trajectory works'
expect planner "pub $controller refused" "pub $request works" 'pub rt/gate/trajectory works' \
  'pub rt/joint_states refused' 'pub rt/guard/scene refused' \
  'pub rq/guard/set_parametersRequest refused'

pids=()
echo '# with strangers: one without keys, one with keys of another authority'
join controller "$enclaves/controller" "sub:$controller"
join guard "$enclaves/trajectory_guard/guard" "sub:$request"
join stranger - "pub:$controller" "pub:$request"
join forger "$work/forged/enclaves/trajectory_guard/gate" "pub:$controller" "pub:$request"
wait "${pids[@]}"
expect controller "sub $controller nobody"
expect guard "sub $request nobody"
expect stranger "pub $controller nobody" "pub $request nobody"
expect forger "pub $controller nobody" "pub $request nobody"
exit "$failed"
