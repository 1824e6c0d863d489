"""
Exact formulas of an arm: `derive` finds them, `compare` judges a person's own.

`derive/` makes frames, Jacobian, determinant and singular set of the table in exact algebra, and
text, page, LaTeX or code of them. `compare/` reads formulas, compares them with the derived ones
or with numbers, and names the slip that explains a difference.
"""
