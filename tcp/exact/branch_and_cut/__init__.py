"""Branch-and-cut for open and closed drill routes, with a proof anybody can check.

Read in this order: :mod:`problem` (nodes, costs), :mod:`cuts` (what an
inequality is), :mod:`relaxation` (the linear programme), :mod:`pricing` (exact
reduced costs of all pairs), :mod:`subtours` and :mod:`combs` (separation),
:mod:`proof` (integer duals and the bound they prove), :mod:`cutting` (the
loop at one node), :mod:`branching`, :mod:`tree` (the search), :mod:`primal`
(better routes), :mod:`evidence` (the certificate), :mod:`run` (the solver).
"""
