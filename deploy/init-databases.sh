#!/bin/sh
# Two databases on a new server, the store and what MLflow keeps of models; roles of readers, operators and admins
# (docs/how-to/deploy-a-server.md); and two logins: "owner", an admin, makes and upgrades the tables, "lab", an operator, is what
# the window and the workers log in as.
# PostgreSQL's image runs this once, before it lets anybody in; by hand: docs/how-to/deploy-a-server.md.
set -eu
SECRETS=${SECRETS:-/run/secrets}
PGUSER=${PGUSER:-${POSTGRES_USER:-postgres}}
export SECRETS PGUSER
# psql reads the passwords itself: an argument could be seen in the list of processes
psql --quiet -v ON_ERROR_STOP=1 -d postgres <<'SQL'
\set owner_password `cat "$SECRETS/owner_password"`
\set lab_password `cat "$SECRETS/lab_password"`
CREATE ROLE pyroshock_reader NOLOGIN;
CREATE ROLE pyroshock_operator NOLOGIN;
CREATE ROLE pyroshock_admin NOLOGIN;
CREATE ROLE pyroshock_owner LOGIN PASSWORD :'owner_password' IN ROLE pyroshock_admin;
CREATE ROLE pyroshock_lab LOGIN PASSWORD :'lab_password' IN ROLE pyroshock_operator;
CREATE DATABASE pyroshock OWNER pyroshock_owner;
CREATE DATABASE pyroshock_models OWNER pyroshock_lab;
REVOKE CONNECT, TEMPORARY ON DATABASE pyroshock, pyroshock_models FROM PUBLIC;
GRANT CONNECT ON DATABASE pyroshock TO pyroshock_reader, pyroshock_operator, pyroshock_admin;
GRANT CONNECT ON DATABASE pyroshock_models TO pyroshock_operator, pyroshock_admin;
SQL
