"""Diagnosis on data whose effect is withheld: draw, seal, diagnose, unseal, score. See README.md here."""
