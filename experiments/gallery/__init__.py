"""A page of questions that small studies answer: one module for each kind of question."""
