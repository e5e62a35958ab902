#!/bin/sh
# Dumps of both databases and the models' files, every night at BACKUP_AT (HH:MM, UTC) or, with --once, now.
# A backup is a folder named by its time; it has its name when it is whole. Those older than KEEP_DAYS go.
# PostgreSQL's own variables (PGHOST, PGUSER, PGPASSFILE) say which server.
set -eu
BACKUPS=${BACKUPS:-/backups} MODELS=${MODELS:-/models} KEEP_DAYS=${KEEP_DAYS:-30} BACKUP_AT=${BACKUP_AT:-02:00}
if [ -r /run/secrets/postgres_password ]; then
  PGPASSWORD=$(cat /run/secrets/postgres_password)
  export PGPASSWORD
fi

# A model's version is registered when its files are written, and its dataset is frozen before it is trained: in this
# order whatever a dump names is in the backup, though people go on working.
backup() {
  now=$(date -u +%Y-%m-%dT%H%M%SZ)
  unfinished=$BACKUPS/.$now
  mkdir -p "$unfinished"
  for database in pyroshock_models pyroshock; do
    pg_dump --format=custom --no-password --dbname="$database" --file="$unfinished/$database.dump"
    pg_restore --list "$unfinished/$database.dump" > /dev/null
  done
  tar -C "$MODELS" -cf "$unfinished/models.tar" .
  mv "$unfinished" "$BACKUPS/$now"
  find "$BACKUPS" -mindepth 1 -maxdepth 1 -type d -mtime +"$KEEP_DAYS" -exec rm -rf {} +
  echo "backup: $BACKUPS/$now"
}

# Seconds until BACKUP_AT comes next. The 1 before each number keeps the shell from reading 08 as an octal one.
wait_s() {
  at=$(( (1${BACKUP_AT%:*} - 100) * 3600 + (1${BACKUP_AT#*:} - 100) * 60 ))
  echo $(( (at - $(date -u +%s) % 86400 + 86399) % 86400 + 1 ))
}

if [ "${1:-}" = --once ]; then
  backup
  exit
fi
while :; do
  sleep "$(wait_s)"
  # in a shell of its own, where the first failure ends it; the next night tries again
  "$0" --once || echo "backup: failed, see above; the last whole one is the newest folder in $BACKUPS" >&2
done
