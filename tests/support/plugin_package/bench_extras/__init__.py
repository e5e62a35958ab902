"""What a laboratory adds to pyroshock: its recorder's files, the inclination of its barrel, and a
model of nearest neighbours."""
