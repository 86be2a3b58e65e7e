! A net of masses and springs as the structure of a run.
!
! 7 x 7 nodes, the edge held; position Verlet, steps of 0.1 ms at most; it repeats a window to equal bytes.
module net_of_springs
  use, intrinsic :: ieee_arithmetic
  use rockfall_solver
  implicit none

  integer, parameter :: SIDE = 7, NODES = SIDE * SIDE, CENTRE = (NODES + 1) / 2, SPRINGS = 2 * SIDE * (SIDE - 1)
  real(c_double), parameter :: SPACING = 0.5d0    ! [m]
  real(c_double), parameter :: REST = 0.49d0      ! length of a spring without force [m]
  real(c_double), parameter :: MASS = 1d0         ! of a node [kg]
  real(c_double), parameter :: STIFFNESS = 5d4    ! of a spring [N/m]
  real(c_double), parameter :: STEP = 1d-4        ! the longest [s]

  type :: state
     real(c_double) :: u(3, NODES) = 0            ! displacement from t = 0 [m]
     real(c_double) :: v(3, NODES) = 0            ! velocity [m/s]
  end type state

  type(state) :: committed, trial
  logical :: held(NODES)
  real(c_double), target :: x(3, NODES) = 0, masses(NODES), radius(SPRINGS) = 0.01d0
  integer(c_int32_t), target :: spring(2, SPRINGS)  ! nodes from 0

  type(rf_field), target :: takes_of(1), gives_of(2)
  type(rf_gauge), target :: gauges_of(2)

contains

  integer(c_int) function prepare(data, plan, ready) bind(c)
    type(c_ptr), value :: data
    type(rf_plan), intent(in) :: plan
    type(rf_ready), intent(inout) :: ready
    integer :: n, i, j, s
    s = 0
    do n = 1, NODES
       i = mod(n - 1, SIDE)
       j = (n - 1) / SIDE
       x(1:2, n) = SPACING * [i - 3, j - 3]
       held(n) = i == 0 .or. j == 0 .or. i == SIDE - 1 .or. j == SIDE - 1
       if (i + 1 < SIDE) then
          s = s + 1
          spring(:, s) = [n - 1, n]
       end if
       if (j + 1 < SIDE) then
          s = s + 1
          spring(:, s) = [n - 1, n - 1 + SIDE]
       end if
    end do
    masses = merge(ieee_value(MASS, ieee_positive_inf), MASS, held)
    gauges_of(1) = rf_gauge(rf_text("centre_uz"), rf_text("m"), RF_NO_ROLE, 1)
    gauges_of(2) = rf_gauge(rf_text("reaction_z"), rf_text("N"), RF_NO_ROLE, 1)
    ready%mesh = rf_mesh(NODES, c_loc(x), SPRINGS, c_loc(spring), c_loc(radius), 0, c_null_ptr, c_loc(masses))
    ready%gauges = c_loc(gauges_of)
    ready%gauge_count = 2
    prepare = RF_OK
  end function prepare

  integer(c_int) function solve(data, window, takes, gives, gauges) bind(c)
    type(c_ptr), value :: data
    type(rf_time_window), intent(in) :: window
    type(c_ptr), intent(in) :: takes(1), gives(2)
    real(c_double), intent(inout) :: gauges(3, 2)
    real(c_double), pointer :: load(:, :), u(:, :), v(:, :)
    real(c_double) :: f(3, NODES), h, support
    integer :: steps, step_number, n
    call c_f_pointer(takes(1), load, [3, NODES])
    call c_f_pointer(gives(1), u, [3, NODES])
    call c_f_pointer(gives(2), v, [3, NODES])
    trial = committed
    steps = max(1, ceiling(window%length / STEP * (1d0 - 1d-9)))
    h = window%length / steps
    gauges(1, :) = 0
    gauges(2, :) = huge(h)
    gauges(3, :) = -huge(h)
    do step_number = 1, steps
       trial%u = trial%u + 0.5d0 * h * trial%v
       f = 0
       call add_forces(trial%u, f)
       support = 0
       do n = 1, NODES
          if (held(n)) then
             support = support - (f(3, n) + load(3, n))
             cycle
          end if
          trial%v(:, n) = trial%v(:, n) + h * (f(:, n) + load(:, n)) / MASS
          trial%u(:, n) = trial%u(:, n) + 0.5d0 * h * trial%v(:, n)
       end do
       call record(gauges(:, 1), trial%u(3, CENTRE), trial%u(3, CENTRE))
       call record(gauges(:, 2), support, gauges(1, 2) + support / steps)
    end do
    u = trial%u
    v = trial%v
    solve = RF_OK
  end function solve

  integer(c_int) function commit(data) bind(c)
    type(c_ptr), value :: data
    committed = trial
    commit = RF_OK
  end function commit

  ! Add the forces of all springs [N].
  subroutine add_forces(u, f)
    real(c_double), intent(in) :: u(3, NODES)
    real(c_double), intent(inout) :: f(3, NODES)
    real(c_double) :: d(3), length, pull
    integer :: s, a, b
    do s = 1, SPRINGS
       a = spring(1, s) + 1
       b = spring(2, s) + 1
       d = (x(:, b) + u(:, b)) - (x(:, a) + u(:, a))
       length = sqrt(d(1) * d(1) + d(2) * d(2) + d(3) * d(3))
       pull = STIFFNESS * (length - REST) / length
       f(:, a) = f(:, a) + pull * d
       f(:, b) = f(:, b) - pull * d
    end do
  end subroutine add_forces

  subroutine record(gauge, value, sum)
    real(c_double), intent(inout) :: gauge(3)
    real(c_double), intent(in) :: value, sum
    gauge(1) = sum
    gauge(2) = min(gauge(2), value)
    gauge(3) = max(gauge(3), value)
  end subroutine record
end module net_of_springs

program net
  use net_of_springs
  implicit none
  type(rf_solver) :: solver
  takes_of(1) = rf_field(rf_text("force"), 3, RF_NODE, RF_MEANS, 1)
  gives_of(1) = rf_field(rf_text("displacement"), 3, RF_NODE, RF_AT_ENDS, 1)
  gives_of(2) = rf_field(rf_text("velocity"), 3, RF_NODE, RF_AT_ENDS, 1)
  solver%program = rf_text("net (Fortran)")
  solver%largest_window = 1d-3
  solver%takes = c_loc(takes_of)
  solver%take_count = 1
  solver%gives = c_loc(gives_of)
  solver%give_count = 2
  solver%prepare = c_funloc(prepare)
  solver%solve = c_funloc(solve)
  solver%commit = c_funloc(commit)
  call exit(rf_serve(solver))
end program net
