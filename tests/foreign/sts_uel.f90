! Segment to segment as a user element of Abaqus, forces alone: nodes are a slave segment and a master segment.
! Two points integrate the overlap, seen along the normal of the slave. The gap is negative in all of it, or it counts 0.
subroutine uel(rhs, amatrx, svars, energy, ndofel, nrhs, nsvars, props, nprops, coords, mcrd, nnode, u, du, v, a, &
    jtype, time, dtime, kstep, kinc, jelem, params, ndload, jdltyp, adlmag, predef, npredf, lflags, mlvarx, ddlmag, &
    mdload, pnewdt, jprops, njprop, period)
  implicit none
  integer :: ndofel, nrhs, nsvars, nprops, mcrd, nnode, jtype, kstep, kinc, jelem, ndload, npredf, mlvarx, mdload, njprop
  integer :: jdltyp(mdload, *), lflags(*), jprops(*)
  double precision :: rhs(mlvarx, *), amatrx(ndofel, ndofel), svars(*), energy(8), props(*), coords(mcrd, nnode)
  double precision :: u(ndofel), du(mlvarx, *), v(ndofel), a(ndofel), time(2), dtime, params(*), adlmag(mdload, *)
  double precision :: predef(2, npredf, nnode), ddlmag(mdload, *), pnewdt, period
  double precision :: x(2, 4), along(2), length, t(2), n(2), first, last, low, high, s, xi, gap, force
  integer :: k

  x = coords + reshape(u, [2, 4])
  along = x(:, 2) - x(:, 1)
  length = sqrt(dot_product(along, along))
  t = along / length
  n = [-t(2), t(1)]
  first = dot_product(x(:, 3) - x(:, 1), t) / length
  last = dot_product(x(:, 4) - x(:, 1), t) / length
  low = max(0d0, last)
  high = min(1d0, first)
  do k = -1, 1, 2
    s = (low + high) / 2 + k * (high - low) / sqrt(12d0)
    xi = (s - first) / (last - first)
    gap = -dot_product((1 - xi) * (x(:, 3) - x(:, 1)) + xi * (x(:, 4) - x(:, 1)), n)
    force = props(1) * min(gap, 0d0) * length * (high - low) / 2
    rhs(:, 1) = rhs(:, 1) - force * [(1 - s) * n, s * n, -(1 - xi) * n, -xi * n]
  end do
end subroutine uel
