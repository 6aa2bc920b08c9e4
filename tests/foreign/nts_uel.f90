! Node to segment as a user element of Abaqus: nodes are a slave node and the two nodes of a master segment.
subroutine uel(rhs, amatrx, svars, energy, ndofel, nrhs, nsvars, props, nprops, coords, mcrd, nnode, u, du, v, a, &
    jtype, time, dtime, kstep, kinc, jelem, params, ndload, jdltyp, adlmag, predef, npredf, lflags, mlvarx, ddlmag, &
    mdload, pnewdt, jprops, njprop, period)
  implicit none
  integer :: ndofel, nrhs, nsvars, nprops, mcrd, nnode, jtype, kstep, kinc, jelem, ndload, npredf, mlvarx, mdload, njprop
  integer :: jdltyp(mdload, *), lflags(*), jprops(*)
  double precision :: rhs(mlvarx, *), amatrx(ndofel, ndofel), svars(*), energy(8), props(*), coords(mcrd, nnode)
  double precision :: u(ndofel), du(mlvarx, *), v(ndofel), a(ndofel), time(2), dtime, params(*), adlmag(mdload, *)
  double precision :: predef(2, npredf, nnode), ddlmag(mdload, *), pnewdt, period
  double precision :: x(2, 3), along(2), arm(2), length, t(2), n(2), g, xi, vn(6), vt(6), vn0(6)
  integer :: i, j

  x = coords(:, 1:3) + reshape(u(1:6), [2, 3])
  along = x(:, 3) - x(:, 2)
  arm = x(:, 1) - x(:, 2)
  length = sqrt(dot_product(along, along))
  t = along / length
  n = [t(2), -t(1)]
  g = dot_product(arm, n)
  if (g >= 0) return
  xi = dot_product(arm, t) / length
  vn = [n, -(1 - xi) * n, -xi * n]
  vt = [t, -(1 - xi) * t, -xi * t]
  vn0 = [0d0 * n, -n, n]
  rhs(1:6, 1) = -props(1) * g * vn
  do j = 1, 6
    do i = 1, 6
      amatrx(i, j) = props(1) * (vn(i) * vn(j) - g / length * (vt(i) * vn0(j) + vn0(i) * vt(j)) &
        - (g / length)**2 * vn0(i) * vn0(j))
    end do
  end do
end subroutine uel
