!> What is right for a case, in quadruple precision: computed, or read from a file of such values.
module extreme_references
  use extreme_cases, only: case_type
  use reference_flow, only: flow_map, periodic_start
  use reference_frame, only: frame_of, frame_system
  use reference_hill, only: distance, hill_solution, solve_hill
  use reference_linear, only: eigenvalues, qp
  use reference_machine, only: period
  implicit none (type, external)
  private

  public :: reference_type, compute_reference, key_of, read_references, reference_of, write_reference

  !> Of the fields of hill_solution; change: of the last refinement, largest of multipliers and x0.
  type :: reference_type
    character(len=60) :: key = ''
    character(len=8) :: route = ''
    real(qp) :: change_rho = huge(1.0_qp), change_x0 = huge(1.0_qp)
    complex(qp) :: log_rho(6) = 0
    real(qp) :: x0(6) = 0
  end type reference_type

  !> A reference that is less certain than this is not one.
  real(qp), parameter, public :: certain = 1.0e-18_qp

contains

  !> Cases that differ in tolerance alone share their reference.
  function key_of(one) result(key)
    type(case_type), intent(in) :: one
    character(len=60) :: key
    integer :: comma

    key = trim(one%family) // ': ' // one%label
    if (one%family /= 'tolerance') return
    comma = index(one%label, ',')
    key = 'speed: ' // one%label(:comma - 1)
  end function key_of

  !> By Hill's method; near dead points, where it would need too many angles, and for heavy links, where the averaged
  !> system is no start for it, by integration with two tolerances.
  subroutine compute_reference(one, reference)
    type(case_type), intent(in) :: one
    type(reference_type), intent(out) :: reference
    type(hill_solution) :: hill
    type(frame_system) :: frame
    type(reference_type) :: coarse

    frame = frame_of(one%machine)
    if (one%family /= 'dead point') call solve_hill(frame, period(one%machine), hill)
    if (one%family == 'dead point' .or. (one%family == 'masses' .and. hill%change_rho > certain)) then
      call integrate(frame, period(one%machine), 1.0e-22_qp, coarse)
      call integrate(frame, period(one%machine), 1.0e-26_qp, reference)
      reference%route = 'flow'
      reference%change_rho = distance(reference%log_rho, coarse%log_rho)
      reference%change_x0 = maxval(abs(reference%x0 - coarse%x0))/maxval(abs(reference%x0))
    else
      reference%route = hill%route
      reference%change_rho = hill%change_rho
      if (size(hill%log_rho) == 6) reference%log_rho = hill%log_rho
    end if
    reference%key = key_of(one)
    if (hill%change_x0 > certain) return
    reference%change_x0 = hill%change_x0
    reference%x0 = hill%x0
  end subroutine compute_reference

  subroutine integrate(frame, time, tolerance, reference)
    type(frame_system), intent(in) :: frame
    real(qp), intent(in) :: time, tolerance
    type(reference_type), intent(out) :: reference
    real(qp) :: phi(6, 6), particular(6)
    complex(qp) :: rho(6)

    call flow_map(frame, 0.0_qp, time, tolerance, phi, particular)
    call eigenvalues(phi, rho)
    reference%log_rho = log(rho)
    reference%x0 = periodic_start(phi, particular)
  end subroutine integrate

  !> The one with the key; its route is blank if there is none.
  function reference_of(one, references) result(reference)
    type(case_type), intent(in) :: one
    type(reference_type), intent(in) :: references(:)
    type(reference_type) :: reference
    integer :: i

    do i = 1, size(references)
      if (references(i)%key == key_of(one)) reference = references(i)
    end do
  end function reference_of

  subroutine write_reference(unit, reference)
    integer, intent(in) :: unit
    type(reference_type), intent(in) :: reference

    write (unit, '(3a)') trim(reference%key), ';', trim(reference%route)
    write (unit, '(2es12.2e4)') reference%change_rho, reference%change_x0
    write (unit, '(2es44.34e4)') reference%log_rho, reference%x0
  end subroutine write_reference

  subroutine read_references(file, references)
    character(len=*), intent(in) :: file
    type(reference_type), allocatable, intent(out) :: references(:)
    type(reference_type) :: one
    character(len=80) :: line
    real(qp) :: log_rho(2, 6)
    integer :: unit, status, place

    allocate (references(0))
    open (newunit=unit, file=file, status='old', action='read')
    do
      read (unit, '(a)', iostat=status) line
      if (status /= 0) exit
      if (line(1:1) == '#') cycle
      place = index(line, ';')
      one%key = line(:place - 1)
      one%route = line(place + 1:)
      read (unit, *) one%change_rho, one%change_x0
      read (unit, *) log_rho, one%x0
      one%log_rho = cmplx(log_rho(1, :), log_rho(2, :), qp)
      references = [references, one]
    end do
    close (unit)
  end subroutine read_references

end module extreme_references
