!> The comparison that README.md sums up: the paper's machine with extreme parameters against quadruple precision.
!>
!>   extremes [FAMILY]             the tables as Markdown, all or one; seconds go to the error output
!>   extremes reference [FAMILY]   computes the reference's values anew, all or one family's, into extremes/references.dat
!>
!> Stops with an error if a true error is above the claimed one, a claim is as great as what it is of, or a verdict is wrong.
program extremes
  use extreme_cases, only: all_cases, case_type
  use extreme_library, only: answer_type, ask_library
  use extreme_references, only: certain, compute_reference, key_of, read_references, reference_of, reference_type, &
    & write_reference
  use extreme_rows, only: compare, header, row_text, row_type
  use, intrinsic :: iso_fortran_env, only: dp => real64, error_unit, output_unit
  implicit none (type, external)

  character(len=*), parameter :: data_file = 'extremes/references.dat'
  !> Claimed over true error.
  real(dp), parameter :: too_wide = 1.0e6_dp
  type(case_type), allocatable :: cases(:)
  character(len=12) :: argument

  cases = all_cases()
  call get_command_argument(1, argument)
  if (argument == 'reference') then
    call get_command_argument(2, argument)
    call renew_references(trim(argument))
  else
    call show_tables(trim(argument))
  end if

contains

  subroutine renew_references(family)
    character(len=*), intent(in) :: family
    type(reference_type), allocatable :: references(:)
    type(reference_type) :: reference
    integer :: i

    allocate (references(0))
    if (family /= '') then
      call read_references(data_file, references)
      references = pack(references, [(index(references(i)%key, family // ':') /= 1, i = 1, size(references))])
    end if
    do i = 1, size(cases)
      reference = reference_of(cases(i), references)
      if (reference%route /= '') cycle
      call compute_reference(cases(i), reference)
      references = [references, reference]
      write (error_unit, '(a, t62, a, 2es10.1)') reference%key, reference%route, reference%change_rho, reference%change_x0
      flush (error_unit)
      call write_all(references)
    end do
  end subroutine renew_references

  subroutine write_all(references)
    type(reference_type), intent(in) :: references(:)
    integer :: i, unit

    open (newunit=unit, file=data_file, action='write', status='replace')
    write (unit, '(a)') '# key;route, changes by the last refinement (ln rho, x0), ln rho (real, imaginary part), x0 (SI units)'
    do i = 1, size(references)
      call write_reference(unit, references(i))
    end do
    close (unit)
  end subroutine write_all

  subroutine show_tables(family)
    character(len=*), intent(in) :: family
    type(reference_type), allocatable :: references(:)
    type(reference_type) :: reference
    type(answer_type) :: answer
    type(row_type) :: row
    character(len=12) :: before
    integer :: rows, beaten, wrong, wide, empty, declined, unknown, i

    call read_references(data_file, references)
    before = ''
    rows = 0
    beaten = 0
    wrong = 0
    wide = 0
    empty = 0
    declined = 0
    unknown = 0
    do i = 1, size(cases)
      if (family /= '' .and. cases(i)%family /= family) cycle
      if (cases(i)%family /= before) then
        print '(/, 3a, /)', '## ', trim(cases(i)%family)
        print '(a)', trim(header(1)), trim(header(2))
      end if
      before = cases(i)%family
      reference = reference_of(cases(i), references)
      call ask_library(cases(i), answer)
      row = compare(answer, reference)
      print '(a)', row_text(cases(i)%label, answer, row)
      flush (output_unit)
      write (error_unit, '(a, t62, f9.3, 2a)') key_of(cases(i)), answer%seconds, ' s', &
        & trim(merge(' BEATEN', '       ', row%beaten)) // trim(merge(' WRONG', '      ', row%wrong)) &
        & // trim(merge(' WIDE', '     ', max(row%wide_rho, row%wide_x0) > too_wide)) // ratios(row)
      rows = rows + 1
      if (row%beaten) beaten = beaten + 1
      if (row%wrong) wrong = wrong + 1
      if (max(row%wide_rho, row%wide_x0) > too_wide) wide = wide + 1
      if (max(row%claimed_rho, row%claimed_x0) >= 1) empty = empty + 1
      if (len(answer%message) > 0) declined = declined + 1
      if (.not. max(reference%change_rho, reference%change_x0) <= certain) unknown = unknown + 1
    end do
    if (rows == 0) error stop 'extremes: no such family', quiet=.true.
    print '(/, 7(i0, a))', rows, ' rows: true error above the claimed one in ', beaten, ', wrong verdicts ', wrong, &
      & ', claims more than 1e6 times too wide ', wide, ', that tell nothing ', empty, ', declined in part or whole ', declined, &
      & ', uncertain references ', unknown, '.'
    if (beaten + wrong + empty > 0) error stop 'extremes: a claim does not hold', quiet=.true.
  end subroutine show_tables

  !> How many times too wide the claims are.
  function ratios(row) result(text)
    type(row_type), intent(in) :: row
    character(len=:), allocatable :: text
    character(len=40) :: buffer

    write (buffer, '(2(a, es8.1))') ' rho', row%wide_rho, ' x0', row%wide_x0
    text = trim(buffer)
  end function ratios

end program extremes
