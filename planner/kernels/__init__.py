"""Machine code: the loops over edge points that most of a planner's time goes to.

Plain functions of numbers and arrays, called like any other. Each names the types of its arguments, and is compiled for
them before the first flight (`planner.compiled`); arrays that it does not change may be read-only. What was compiled is
kept on disk by file, so that a function here calls compiled functions of its own file only.

Everything is metres in the local ENU plane. Points that stand are (3, m): east, north and the distance to be kept from
each, one row after the other.
"""
