"""Marks of diagnoses against the answers, and the table, pictures and intervals made of them."""
