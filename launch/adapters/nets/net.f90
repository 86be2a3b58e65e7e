! A net of cables and trusses as the structure of a run, read from what `rockfall export` writes of a scene.
!
! usage: net MODELLED.mdpa REST.mdpa ...   (both files are of one scene, the second is written with --at-rest)
!
! Position Verlet in steps of `fem.time_step` of the scene at most, with its `structure.damping`; it repeats a window to equal bytes.
module net_of_cables
  use, intrinsic :: ieee_arithmetic
  use rockfall_solver
  implicit none

  integer, parameter :: dp = c_double

  type :: state
     real(dp), allocatable :: x(:, :), v(:, :)      ! places [m], velocities [m/s]
     real(dp) :: largest = 0                        ! reaction so far [N]
  end type state

  type(state) :: committed, trial
  integer :: nodes, lines, shown                    ! `shown`: the node of the gauge
  real(dp), allocatable :: modelled(:, :), gravity(:, :), mass(:)
  real(dp), allocatable :: young(:), area(:), density(:), prestress(:)      ! of sections
  real(dp), allocatable :: square(:), pull(:), slope(:), least(:)           ! of elements
  logical, allocatable :: held(:, :)
  integer, allocatable :: section_of(:)
  real(dp) :: longest, damping
  real(dp), allocatable, target :: rest(:, :), masses(:), radius(:)
  integer(c_int32_t), allocatable, target :: ends(:, :)                     ! nodes from 0

  type(rf_field), target :: takes_of(1), gives_of(2)
  type(rf_gauge), target :: gauges_of(4)

contains

  integer(c_int) function prepare(data, plan, ready) bind(c)
    type(c_ptr), value :: data
    type(rf_plan), intent(in) :: plan
    type(rf_ready), intent(inout) :: ready
    real(dp) :: length, at(3)
    integer :: i, n
    prepare = read_file(2, rest)
    if (prepare == RF_OK) prepare = read_file(1, modelled)
    if (prepare /= RF_OK) return
    longest = rf_number("fem.time_step" // c_null_char, 0d0)
    damping = rf_number("structure.damping" // c_null_char, 0d0)
    if (.not. longest > 0) then
       prepare = refuse("fem.time_step: the net needs one, below 2 / w (`rockfall check` prints it)")
       return
    end if

    allocate (square(lines), pull(lines), slope(lines), radius(lines), mass(nodes), masses(nodes))
    mass = 0
    radius = rf_number("structure.cable.radius" // c_null_char, 0d0)
    do i = 1, lines
       square(i) = sum((modelled(:, ends(2, i) + 1) - modelled(:, ends(1, i) + 1))**2)
       length = sqrt(square(i))
       n = section_of(i)
       ! Pull per length: S A / L with S = prestress + E e, and the Green-Lagrange strain e = (l^2 - L^2) / (2 L^2).
       pull(i) = prestress(n) * area(n) / length
       slope(i) = young(n) * area(n) / (2 * length * square(i))
       mass(ends(1, i) + 1) = mass(ends(1, i) + 1) + 0.5d0 * density(n) * area(n) * length
       mass(ends(2, i) + 1) = mass(ends(2, i) + 1) + 0.5d0 * density(n) * area(n) * length
    end do
    masses = merge(ieee_value(1d0, ieee_positive_inf), mass, all(held, 1))
    at = [(rf_number("gauge.0.at." // achar(48 + i) // c_null_char, 0d0), i = 0, 2)]
    shown = minloc(sum((rest - spread(at, 2, nodes))**2, 1), 1)
    committed%x = rest
    committed%v = 0 * rest
    gauges_of = [(rf_gauge(rf_text("reaction_" // achar(119 + i)), rf_text("N"), RF_NO_ROLE, 0), i = 1, 3), &
         rf_gauge(rf_text("centre_uz"), rf_text("m"), RF_NO_ROLE, 1)]
    ready%mesh = rf_mesh(nodes, c_loc(rest), lines, c_loc(ends), c_loc(radius), 0, c_null_ptr, c_loc(masses))
    ready%gauges = c_loc(gauges_of)
    ready%gauge_count = 4
  end function prepare

  ! Read the .mdpa file that is argument `number`, places of its nodes into `place`.
  integer(c_int) function read_file(number, place)
    integer, intent(in) :: number
    real(dp), allocatable, intent(out) :: place(:, :)
    character(len=512) :: name, line
    character(len=64) :: kind, what
    integer :: unit, rows, code, id, section, a, b, c
    real(dp) :: value
    call get_command_argument(number, name)
    open (newunit=unit, file=name, status="old", action="read", iostat=code)
    if (code /= 0) then
       read_file = refuse("usage: net MODELLED.mdpa REST.mdpa (rockfall export); cannot be read: " // trim(name))
       return
    end if
    rows = 0                                        ! more than there are nodes or elements
    do
       read (unit, "(a)", iostat=code) line
       if (code /= 0) exit
       rows = rows + 1
    end do
    rewind (unit)
    if (allocated(ends)) deallocate (ends, least, section_of, held, gravity, young, area, density, prestress)
    allocate (place(3, rows), ends(2, rows), least(rows), section_of(rows), gravity(3, rows), held(3, rows))
    allocate (young(rows), area(rows), density(rows), prestress(rows))
    gravity = 0
    held = .false.
    nodes = 0
    lines = 0
    kind = ""
    do
       read (unit, "(a)", iostat=code) line
       if (code /= 0) exit
       if (line(:6) == "Begin ") then
          line = line(7:)
          c = index(line, " ")
          kind = line(:c)
          what = line(c + 1:)
          if (kind == "Elements" .and. what /= "CableElement3D2N" .and. what /= "TrussElement3D2N") then
             read_file = refuse(trim(name) // ": " // trim(what) // ": cables and trusses alone are computed")
             return
          end if
          if (kind == "Properties") read (what, *) section
       else if (line(:4) == "End ") then
          kind = ""
       else if (kind == "Properties") then
          c = index(line, " ")
          select case (line(:c))
          case ("YOUNG_MODULUS"); read (line(c:), *) young(section)
          case ("CROSS_AREA"); read (line(c:), *) area(section)
          case ("DENSITY"); read (line(c:), *) density(section)
          case ("TRUSS_PRESTRESS_PK2"); read (line(c:), *) prestress(section)
          end select
       else if (kind == "Nodes") then
          nodes = nodes + 1
          read (line, *) id, place(:, nodes)
          if (id /= nodes) then
             read_file = refuse(trim(name) // ": nodes must count from 1")
             return
          end if
       else if (kind == "Elements") then
          lines = lines + 1
          read (line, *) id, section_of(lines), a, b
          ends(:, lines) = [a, b] - 1
          least(lines) = merge(0d0, -huge(0d0), what(:1) == "C")
       else if (kind == "NodalData") then
          read (line, *) id, section, value
          c = index("XYZ", what(len_trim(what):len_trim(what)))
          if (what(:1) == "D") held(c, id) = .true.
          if (what(:1) == "V") gravity(c, id) = value
       end if
    end do
    close (unit)
    place = place(:, :nodes)
    gravity = gravity(:, :nodes)
    held = held(:, :nodes)
    read_file = RF_OK
  end function read_file

  ! Force of elements and weight on each node at the places `x` [N].
  function forces(x) result(f)
    real(dp), intent(in) :: x(:, :)
    real(dp) :: f(3, nodes), d(3)
    integer :: i, a, b
    do i = 1, nodes
       f(:, i) = mass(i) * gravity(:, i)
    end do
    do i = 1, lines
       a = ends(1, i) + 1
       b = ends(2, i) + 1
       d = x(:, b) - x(:, a)
       d = max(pull(i) + slope(i) * (sum(d * d) - square(i)), least(i)) * d
       f(:, a) = f(:, a) + d
       f(:, b) = f(:, b) - d
    end do
  end function forces

  integer(c_int) function start(data, gives, gauges) bind(c)
    type(c_ptr), value :: data
    type(c_ptr), intent(in) :: gives(2)
    real(c_double), intent(inout) :: gauges(3, 4)
    gauges(:, :3) = spread(-sum(forces(rest), 2, held), 1, 3)
    start = RF_OK
  end function start

  integer(c_int) function solve(data, window, takes, gives, gauges) bind(c)
    type(c_ptr), value :: data
    type(rf_time_window), intent(in) :: window
    type(c_ptr), intent(in) :: takes(1), gives(2)
    real(c_double), intent(inout) :: gauges(3, 4)
    real(dp), pointer :: load(:, :), u(:, :), v(:, :)
    real(dp) :: middle(3, nodes), f(3, nodes), h, c, now(4)
    integer :: steps, step, n
    call c_f_pointer(takes(1), load, [3, nodes])
    call c_f_pointer(gives(1), u, [3, nodes])
    call c_f_pointer(gives(2), v, [3, nodes])
    trial = committed
    steps = max(1, ceiling(window%length / longest * (1d0 - 1d-9)))
    h = window%length / steps
    c = 0.5d0 * h * damping
    gauges(1, :) = 0
    gauges(2, :) = huge(h)
    gauges(3, :) = -huge(h)
    do step = 1, steps
       middle = trial%x + 0.5d0 * h * trial%v
       f = forces(middle) + load
       do n = 1, nodes
          trial%v(:, n) = merge(0d0, ((1 - c) * trial%v(:, n) + h * f(:, n) / mass(n)) / (1 + c), held(:, n))
       end do
       trial%x = middle + 0.5d0 * h * trial%v
       now = [-sum(f, 2, held), trial%x(3, shown) - rest(3, shown)]
       trial%largest = max(trial%largest, norm2(now(:3)))
       gauges(1, :) = [gauges(1, :3) + now(:3) / steps, now(4)]
       gauges(2, :) = min(gauges(2, :), now)
       gauges(3, :) = max(gauges(3, :), now)
    end do
    u = trial%x - rest
    v = trial%v
    solve = RF_OK
  end function solve

  integer(c_int) function commit(data) bind(c)
    type(c_ptr), value :: data
    committed = trial
    commit = RF_OK
  end function commit

  integer(c_int) function finish(data) bind(c)
    type(c_ptr), value :: data
    call rf_measure("max_reaction" // c_null_char, committed%largest, "N" // c_null_char)
    finish = RF_OK
  end function finish

  integer(c_int) function refuse(what)
    character(len=*), intent(in) :: what
    call rf_explain(what // c_null_char)
    refuse = RF_INPUT
  end function refuse
end module net_of_cables

program net
  use net_of_cables
  implicit none
  type(rf_solver) :: solver
  takes_of(1) = rf_field(rf_text("force"), 3, RF_NODE, RF_MEANS, 1)
  gives_of(1) = rf_field(rf_text("displacement"), 3, RF_NODE, RF_AT_ENDS, 1)
  gives_of(2) = rf_field(rf_text("velocity"), 3, RF_NODE, RF_AT_ENDS, 1)
  solver%program = rf_text("net of cables (Fortran)")
  solver%takes = c_loc(takes_of)
  solver%take_count = 1
  solver%gives = c_loc(gives_of)
  solver%give_count = 2
  solver%prepare = c_funloc(prepare)
  solver%start = c_funloc(start)
  solver%solve = c_funloc(solve)
  solver%commit = c_funloc(commit)
  solver%finish = c_funloc(finish)
  call exit(rf_serve(solver))
end program net
