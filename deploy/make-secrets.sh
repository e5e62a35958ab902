#!/bin/sh
# Passwords and the window's token, at random, in the folder "secrets" beside this file. What is there stays.
# pgpass is for the user of the image (10001), who alone may read it: libpq refuses one that others can.
set -eu
cd "$(dirname "$0")"
umask 077
mkdir -p secrets
word() { head -c 32 /dev/urandom | od -An -v -tx1 | tr -d ' \n'; }
for name in postgres_password owner_password lab_password window_token; do
  [ -s "secrets/$name" ] || word > "secrets/$name"
done
{
  echo "*:5432:*:pyroshock_owner:$(cat secrets/owner_password)"
  echo "*:5432:*:pyroshock_lab:$(cat secrets/lab_password)"
} > secrets/pgpass
chmod 444 secrets/postgres_password secrets/owner_password secrets/lab_password secrets/window_token
if ! chown 10001 secrets/pgpass 2>/dev/null; then
  echo "secrets/pgpass must belong to user 10001: sudo chown 10001 deploy/secrets/pgpass" >&2
fi
