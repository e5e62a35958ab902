"""The lab's window: pages and a JSON API over the same actions as the command line."""
