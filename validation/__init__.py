"""How good the answers are: the blind check of diagnoses (campaigns whose effect is withheld,
diagnosed from their folders alone, and scored afterwards), and the scores of predictions beside
measured shots."""
