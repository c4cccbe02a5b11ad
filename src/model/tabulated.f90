!> A mechanism that remembers its mass functions where they will be asked for again: one table serves every speed,
!> stiffness, damping and frame.
module gestell_model_tabulated
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_model_mechanism, only: mass_functions_type, mechanism_type, table_columns
  implicit none (type, external)
  private

  public :: new_tabulated

  type :: table_type
    !> Crank angles (rad) and the mass functions there, shape (angles, table_columns).
    real(dp), allocatable :: angles(:), values(:, :)
  end type table_type

  !> Behaves as the mechanism that it was made from; what is asked for at exactly the angles of a table is looked up.
  type, extends(mechanism_type), public :: tabulated_type
    private
    class(mechanism_type), allocatable :: source
    type(table_type), allocatable :: tables(:)
  contains
    procedure :: remember
    procedure :: mass_functions
    procedure :: tabulate
    procedure :: tabulate_drive
    procedure :: prepare
  end type tabulated_type

contains

  !> `mechanism` with no tables yet.
  subroutine new_tabulated(tabulated, mechanism)
    type(tabulated_type), intent(out) :: tabulated
    class(mechanism_type), intent(in) :: mechanism

    allocate(tabulated%source, source=mechanism)
    allocate(tabulated%tables(0))
    call take_over(tabulated)
  end subroutine new_tabulated

  !> Tabulates the mass functions at these crank angles (rad), in their order.
  subroutine remember(self, angles)
    class(tabulated_type), intent(inout) :: self
    real(dp), contiguous, intent(in) :: angles(:)
    type(table_type), allocatable :: longer(:)
    integer :: i

    allocate(longer(size(self%tables) + 1))
    do i = 1, size(self%tables)
      call move_alloc(self%tables(i)%angles, longer(i)%angles)
      call move_alloc(self%tables(i)%values, longer(i)%values)
    end do
    associate (new => longer(size(longer)))
      allocate(new%angles, source=angles)
      allocate(new%values(size(angles), table_columns))
      call self%source%tabulate(new%angles, new%values)
    end associate
    call move_alloc(longer, self%tables)
  end subroutine remember

  subroutine mass_functions(self, crank_angle, a)
    class(tabulated_type), intent(in) :: self
    real(dp), intent(in) :: crank_angle
    type(mass_functions_type), intent(out) :: a

    call self%source%mass_functions(crank_angle, a)
  end subroutine mass_functions

  !> From the table with exactly these angles in this order, if there is one.
  subroutine tabulate(self, angles, table)
    class(tabulated_type), intent(in) :: self
    real(dp), contiguous, intent(in) :: angles(:)
    real(dp), contiguous, intent(out) :: table(:, :)
    integer :: i

    do i = 1, size(self%tables)
      associate (known => self%tables(i))
        if (size(known%angles) /= size(angles)) cycle
        if (any(abs(known%angles - angles) > 0)) cycle
        table = known%values
        return
      end associate
    end do
    call self%source%tabulate(angles, table)
  end subroutine tabulate

  subroutine prepare(self, error)
    class(tabulated_type), intent(inout) :: self
    type(error_type), allocatable, intent(out) :: error

    call self%source%prepare(error)
    call take_over(self)
  end subroutine prepare

  pure subroutine take_over(self)
    class(tabulated_type), intent(inout) :: self

    self%mass = self%source%mass
    self%inertia = self%source%inertia
    self%feature = self%source%feature
    self%terms = self%source%terms
  end subroutine take_over

  subroutine tabulate_drive(self, angles, table, known)
    class(tabulated_type), intent(in) :: self
    real(dp), intent(in) :: angles(:)
    real(dp), intent(out) :: table(:, :)
    logical, intent(out) :: known

    call self%source%tabulate_drive(angles, table, known)
  end subroutine tabulate_drive

end module gestell_model_tabulated
