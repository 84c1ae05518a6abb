"""What is compiled: the integrators, in the part of Python that Numba understands. Imported only in order to compile.

Each integrator is one function of one argument, the addresses of the arrays that `routes` describes. One compiled
integrator serves every equation, whose machine code it calls by its address.
"""
