"""Words that a page uses, as its last section."""

from jaxident.report.page import Section, Table
from jaxident.report.terms import TERMS


def glossary(*terms: str) -> Section:
    """These terms as a folded section."""
    return Section("Words", [Table(("word", "meaning"), [(term, TERMS[term]) for term in terms])], folded=True)
