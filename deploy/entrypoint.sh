#!/bin/sh
# The token is a file among the secrets; the window takes it from its environment.
set -eu
if [ -r /run/secrets/window_token ]; then
  PYROSHOCK_TOKEN=$(cat /run/secrets/window_token)
  export PYROSHOCK_TOKEN
fi
exec "$@"
