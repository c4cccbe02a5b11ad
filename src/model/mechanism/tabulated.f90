!> A mechanism with tables of its mass functions, for angles at which they are required repeatedly. The tables do not depend on
!> speed, stiffness, damping or frame.
module gestell_model_mechanism_tabulated
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_model_mechanism, only: drive_columns, load_sums_type, mass_functions_type, mechanism_type, table_columns
  implicit none (type, external)
  private

  public :: new_tabulated

  !> Table of the functions of a mechanism at given crank angles.
  type :: table_type
    !> `angles`: crank angles (rad). `values`: mass functions at these angles, shape (angles, table_columns). `drive`: functions H
    !> and K of the drive (angular momentum, and twice the kinetic energy, at unit crank speed), shape (angles, drive_columns);
    !> allocated only if requested and known.
    real(dp), allocatable :: angles(:), values(:, :), drive(:, :)
  end type table_type

  !> A mechanism with the same results as the mechanism from which it was created. If exactly the angles of a table are requested,
  !> the values come from the table.
  type, extends(mechanism_type), public :: tabulated_type
    !> The mechanism from which this one was created
    class(mechanism_type), allocatable :: source
    type(table_type), allocatable, private :: tables(:)
  contains
    procedure :: remember, set_drive_functions, mass_functions, tabulate, tabulate_drive, sum_loads, prepare, link_offset
  end type tabulated_type

contains

  !> Creates a mechanism that can hold tables of `mechanism`; it has no table at first.
  subroutine new_tabulated(tabulated, mechanism)
    type(tabulated_type), intent(out) :: tabulated
    class(mechanism_type), intent(in) :: mechanism

    allocate(tabulated%source, source=mechanism)
    allocate(tabulated%tables(0))
    call take_over(tabulated)
  end subroutine new_tabulated

  !> Tabulates the mass functions at crank angles (rad) and, if `drive` is true, the functions H and K of the drive (angular
  !> momentum, and twice the kinetic energy, at unit crank speed).
  subroutine remember(self, angles, drive)
    class(tabulated_type), intent(inout) :: self
    real(dp), contiguous, intent(in) :: angles(:)
    logical, intent(in) :: drive
    type(table_type), allocatable :: longer(:)
    logical :: known
    integer :: i

    allocate(longer(size(self%tables) + 1))
    do i = 1, size(self%tables)
      call move_alloc(self%tables(i)%angles, longer(i)%angles)
      call move_alloc(self%tables(i)%values, longer(i)%values)
      call move_alloc(self%tables(i)%drive, longer(i)%drive)
    end do
    associate (new => longer(size(longer)))
      allocate(new%angles, source=angles)
      allocate(new%values(size(angles), table_columns))
      call self%source%tabulate(new%angles, new%values)
      if (drive) then
        allocate(new%drive(size(angles), drive_columns))
        call self%source%tabulate_drive(new%angles, new%drive, known)
        if (.not. known) deallocate(new%drive)
      end if
    end associate
    call move_alloc(longer, self%tables)
  end subroutine remember

  !> Stores the functions H and K of the drive (angular momentum, and twice the kinetic energy, at unit crank speed), which the
  !> caller has computed for the angles of the last table; shape (angles, drive_columns).
  pure subroutine set_drive_functions(self, drive)
    class(tabulated_type), intent(inout) :: self
    real(dp), intent(in) :: drive(:, :)

    self%tables(size(self%tables))%drive = drive
  end subroutine set_drive_functions

  subroutine mass_functions(self, crank_angle, a)
    class(tabulated_type), intent(in) :: self
    real(dp), intent(in) :: crank_angle
    type(mass_functions_type), intent(out) :: a

    call self%source%mass_functions(crank_angle, a)
  end subroutine mass_functions

  !> Returns the mass functions at the given angles. They are copied if a table has exactly these angles in this order, and
  !> computed otherwise.
  subroutine tabulate(self, angles, table)
    class(tabulated_type), intent(in) :: self
    real(dp), contiguous, intent(in) :: angles(:)
    real(dp), contiguous, intent(out) :: table(:, :)
    integer :: i

    i = index_of(self, angles)
    if (i > 0) then
      table = self%tables(i)%values
    else
      call self%source%tabulate(angles, table)
    end if
  end subroutine tabulate

  !> Number of the table with exactly these angles; 0 if there is no such table.
  pure integer function index_of(self, angles) result(i)
    class(tabulated_type), intent(in) :: self
    real(dp), intent(in) :: angles(:)

    do i = 1, size(self%tables)
      if (size(self%tables(i)%angles) /= size(angles)) cycle
      if (all(abs(self%tables(i)%angles - angles) <= 0)) return
    end do
    i = 0
  end function index_of

  subroutine prepare(self, error)
    class(tabulated_type), intent(inout) :: self
    type(error_type), allocatable, intent(out) :: error

    call self%source%prepare(error)
    call take_over(self)
  end subroutine prepare

  pure real(dp) function link_offset(self, name) result(offset)
    class(tabulated_type), intent(in) :: self
    character(len=*), intent(in) :: name

    offset = self%source%link_offset(name)
  end function link_offset

  pure subroutine take_over(self)
    class(tabulated_type), intent(inout) :: self

    self%mass = self%source%mass
    self%inertia = self%source%inertia
    self%angle_scale = self%source%angle_scale
    self%terms = self%source%terms
    self%turns = self%source%turns
    self%load_order = self%source%load_order
    self%has_ground_loads = self%source%has_ground_loads
    if (allocated(self%source%crank_turns)) self%crank_turns = self%source%crank_turns
    if (allocated(self%source%kinks)) self%kinks = self%source%kinks
    self%jumps = self%source%jumps
    self%has_crank = self%source%has_crank
  end subroutine take_over

  subroutine tabulate_drive(self, angles, table, known)
    class(tabulated_type), intent(in) :: self
    real(dp), intent(in) :: angles(:)
    real(dp), intent(out) :: table(:, :)
    logical, intent(out) :: known
    integer :: i

    i = index_of(self, angles)
    known = .false.
    if (i > 0) known = allocated(self%tables(i)%drive)
    if (known) then
      table = self%tables(i)%drive
    else
      call self%source%tabulate_drive(angles, table, known)
    end if
  end subroutine tabulate_drive

  !> Sums the loads, which are in no table.
  pure subroutine sum_loads(self, angles, origin, sums)
    class(tabulated_type), intent(in) :: self
    real(dp), intent(in) :: angles(:), origin(2)
    type(load_sums_type), intent(out) :: sums(:)

    call self%source%sum_loads(angles, origin, sums)
  end subroutine sum_loads

end module gestell_model_mechanism_tabulated
