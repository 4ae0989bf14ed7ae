"""Reports as single HTML pages that need nothing else: no network, no script, no second file."""

from jaxident.report.page import Code, Figure, Page, Section, Table, render, write_page

__all__ = ["Code", "Figure", "Page", "Section", "Table", "render", "write_page"]
