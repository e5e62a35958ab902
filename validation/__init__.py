"""The blind check: campaigns whose effect is withheld, diagnosed from their folders alone, and scored afterwards."""
