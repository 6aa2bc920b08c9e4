! A user element that breaks a rule; PROPS(3) says which. With 12 it says what it got, and with 13 it never returns.
subroutine uel(rhs, amatrx, svars, energy, ndofel, nrhs, nsvars, props, nprops, coords, mcrd, nnode, u, du, v, a, &
    jtype, time, dtime, kstep, kinc, jelem, params, ndload, jdltyp, adlmag, predef, npredf, lflags, mlvarx, ddlmag, &
    mdload, pnewdt, jprops, njprop, period)
  implicit none
  integer :: ndofel, nrhs, nsvars, nprops, mcrd, nnode, jtype, kstep, kinc, jelem, ndload, npredf, mlvarx, mdload, njprop
  integer :: jdltyp(mdload, *), lflags(*), jprops(*)
  double precision :: rhs(mlvarx, *), amatrx(ndofel, *), svars(*), energy(8), props(*), coords(mcrd, nnode)
  double precision :: u(ndofel), du(mlvarx, *), v(ndofel), a(ndofel), time(2), dtime, params(*), adlmag(mdload, *)
  double precision :: predef(2, npredf, nnode), ddlmag(mdload, *), pnewdt, period

  if (nint(props(3)) == 12) rhs(1:6, 1) = -[jprops(1:4), nnode, jelem]
  do while (nint(props(3)) == 13)
  end do
  if (jelem /= 2) return
  select case (nint(props(3)))
  case (1)
    svars(nsvars + 1) = 0
  case (2)
    amatrx(:, ndofel + 1) = 0
  case (3)
    coords(2, 3) = coords(2, 3) + 1
  case (4)
    svars(1500000000) = 1
  case (5)
    pnewdt = 0.25d0
  case (6)
    stop 3
  case (7)
    svars(0) = 0
  case (8)
    nnode = 4
  case (9)
    rhs(1, 1) = props(nprops + 1)
  case (10)
    svars(1) = svars(1) + 1
    rhs(1, 1) = svars(1)
  case (11)
    jprops(njprop + 1) = 0
  end select
end subroutine uel
