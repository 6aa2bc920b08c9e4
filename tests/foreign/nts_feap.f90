! Node to segment as a user element of FEAP: nodes are a slave node and the two nodes of a master segment.
! It reads their number and the factor of its tangent from common blocks, as most elements of FEAP do.
subroutine elmt07(d, ul, xl, ix, tl, s, p, ndf, ndm, nst, isw)
  implicit none
  integer :: ndf, ndm, nst, isw, ix(*), i, j
  double precision :: d(*), ul(ndf, 3, *), xl(ndm, 3), tl(*), s(nst, nst), p(nst)
  double precision :: dm, bpr(3), ctan(3)
  integer :: n_el, ma, mct, iel, nel
  common /eldata/ dm, n_el, ma, mct, iel, nel
  common /eltran/ bpr, ctan
  double precision :: x(2, 3), along(2), arm(2), length, t(2), n(2), g, xi, vn(6), vt(6), vn0(6)

  if (isw /= 3) return
  x = xl + ul(:, :, 1)
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
  p = -d(1) * g * vn
  do j = 1, 2 * nel
    do i = 1, 2 * nel
      s(i, j) = ctan(1) * d(1) * (vn(i) * vn(j) - g / length * (vt(i) * vn0(j) + vn0(i) * vt(j)) &
        - (g / length)**2 * vn0(i) * vn0(j))
    end do
  end do
end subroutine elmt07
