! A solver for rockfall in Fortran: the names of rockfall_solver.h, where shapes and units stand. Compile this file with your own.
!
! Arrays of fields are (components, items, samples): c_f_pointer(takes(1), force, [3, nodes]). Nodes count from 0 in line_nodes and
! face_nodes. Texts end with c_null_char; rf_text makes one that stays. A function returns RF_OK, or another number after
! rf_explain; `stop` ends the program, and the run with it, without a reason. rf_window of C is rf_time_window here: Fortran takes
! RF_WINDOW for the same name.
module rockfall_solver
  use, intrinsic :: iso_c_binding
  implicit none

  integer(c_int), parameter :: RF_OK = 0, RF_INPUT = 1, RF_WINDOW = 2, RF_BROKEN = 3
  integer(c_int32_t), parameter :: RF_NODE = 0, RF_LINE = 1, RF_FACE = 2, RF_WHOLE = 3
  integer(c_int32_t), parameter :: RF_AT_ENDS = 0, RF_FROM_START = 1, RF_MEANS = 2, RF_ONCE = 3
  integer(c_int32_t), parameter :: RF_NO_ROLE = 0, RF_KINETIC = 1, RF_POTENTIAL = 2, RF_STORED = 3, &
       RF_DISSIPATED = 4, RF_RECEIVED = 5

  type, bind(c) :: rf_field
     type(c_ptr) :: name = c_null_ptr
     integer(c_int32_t) :: components = 3, place = RF_NODE, sampling = RF_AT_ENDS, samples = 1
  end type rf_field

  type, bind(c) :: rf_mesh
     integer(c_size_t) :: nodes = 0
     type(c_ptr) :: coordinates = c_null_ptr
     integer(c_size_t) :: lines = 0
     type(c_ptr) :: line_nodes = c_null_ptr, line_radius = c_null_ptr
     integer(c_size_t) :: faces = 0
     type(c_ptr) :: face_nodes = c_null_ptr, masses = c_null_ptr
  end type rf_mesh

  type, bind(c) :: rf_gauge
     type(c_ptr) :: name = c_null_ptr, unit = c_null_ptr
     integer(c_int32_t) :: role = RF_NO_ROLE, extremes = 0
  end type rf_gauge

  type, bind(c) :: rf_plan
     real(c_double) :: end_time, window
     type(c_ptr) :: takes, gives, partner
  end type rf_plan

  type, bind(c) :: rf_ready
     type(rf_mesh) :: mesh
     type(c_ptr) :: gauges
     integer(c_size_t) :: gauge_count
  end type rf_ready

  type, bind(c) :: rf_time_window
     integer(c_int64_t) :: number, iteration
     real(c_double) :: start, length
  end type rf_time_window

  type, bind(c) :: rf_solver
     type(c_ptr) :: program = c_null_ptr, data = c_null_ptr
     real(c_double) :: repeats = 0, largest_window = 0
     type(c_ptr) :: takes = c_null_ptr
     integer(c_size_t) :: take_count = 0
     type(c_ptr) :: gives = c_null_ptr
     integer(c_size_t) :: give_count = 0
     type(c_funptr) :: prepare = c_null_funptr, start = c_null_funptr, solve = c_null_funptr, &
          commit = c_null_funptr, finish = c_null_funptr, at_rest = c_null_funptr, save = c_null_funptr, &
          resume = c_null_funptr
  end type rf_solver

  interface
     integer(c_int) function rf_serve(solver) bind(c)
       import :: c_int, rf_solver
       type(rf_solver), intent(in) :: solver
     end function rf_serve

     subroutine rf_explain(reason) bind(c)
       import :: c_char
       character(kind=c_char), intent(in) :: reason(*)
     end subroutine rf_explain

     integer(c_int) function rf_progress(what, done) bind(c)
       import :: c_char, c_double, c_int
       character(kind=c_char), intent(in) :: what(*)
       real(c_double), value :: done
     end function rf_progress

     subroutine rf_measure(name, value, unit) bind(c)
       import :: c_char, c_double
       character(kind=c_char), intent(in) :: name(*), unit(*)
       real(c_double), value :: value
     end subroutine rf_measure

     real(c_double) function rf_number(key, otherwise) bind(c)
       import :: c_char, c_double
       character(kind=c_char), intent(in) :: key(*)
       real(c_double), value :: otherwise
     end function rf_number
  end interface

contains

  ! A text for a field, a gauge or the program; it stays until the program ends.
  type(c_ptr) function rf_text(text)
    character(len=*), intent(in) :: text
    character(kind=c_char), pointer :: kept(:)
    integer :: i
    allocate (kept(len(text) + 1))
    do i = 1, len(text)
       kept(i) = text(i:i)
    end do
    kept(len(text) + 1) = c_null_char
    rf_text = c_loc(kept(1))
  end function rf_text
end module rockfall_solver
