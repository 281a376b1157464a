"""Contact problems with a stored W: block-sparse operator, and the compiled portfolio of solvers for it.

Public: `StoredDelassus`, `StoredForm` (operator); `StoredAuto` (portfolio); `write_own_problems` (own_problems).
"""
