"""Accounts of energy and momentum, and diagnostics of a state.

All accounts use these words:

kinetic, potential, energy  energy of the liquid [J]; energy is the sum of both
momentum                    of the liquid (6,): linear [N s], and angular about the origin [N m s]
change                      gain of the liquid in energy and momentum; negative for a loss
cause                       the stage of the time step that made a change
work, impulse               energy [J] and momentum [N s, N m s] that bodies received from the liquid
dissipation                 kinetic energy that became heat [J], by viscosity or by the scheme
unexplained                 change for which no cause accounts
turnover                    sum of the magnitudes of all changes
residual                    the unexplained part over the turnover [1]
"""
