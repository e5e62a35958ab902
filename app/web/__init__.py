"""The web application: pages and a JSON API over the same actions as the command line."""
