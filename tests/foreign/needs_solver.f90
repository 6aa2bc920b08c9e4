! A user element that calls a function of its solver, which no library has.
subroutine uel
  external xit
  call xit
end subroutine uel
