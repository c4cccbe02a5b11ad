!> supports.csv, supports_history.csv, supports_harmonics.csv: the forces on the ground, place by place.
module gestell_task_forces_csv
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: text
  use gestell_output_table_csv, only: row, write_table
  use gestell_task_findings_csv, only: add_harmonics, write_harmonics, write_turn
  use gestell_task_findings, only: findings_type
  use gestell_task_forces_ground, only: force_parts, moment, place_type, whole_force
  implicit none (type, external)
  private

  public :: write_forces

  character(len=*), parameter :: names(force_parts) = [character(len=2) :: "fx", "fy", "f", "m"]
  character(len=*), parameter :: units(force_parts) = [character(len=2) :: "N", "N", "N", "Nm"]

contains

  !> Error: a file cannot be written.
  subroutine write_forces(folder, preamble, findings, harmonics, error)
    character(len=*), intent(in) :: folder, preamble(:)
    type(findings_type), intent(in) :: findings
    integer, intent(in) :: harmonics
    type(error_type), allocatable, intent(out) :: error

    call write_places(folder, preamble, findings, error)
    if (.not. allocated(error)) call write_histories(folder, preamble, findings, error)
    if (.not. allocated(error)) call write_series(folder, preamble, findings, harmonics, error)
  end subroutine write_forces

  !> One row a place. Orders, which are whole numbers, follow; with weights the static forces end the row.
  subroutine write_places(folder, preamble, findings, error)
    character(len=*), intent(in) :: folder, preamble(:)
    type(findings_type), intent(in) :: findings
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: told = 5
    real(dp) :: values(2 + told * force_parts, size(findings%places))
    character(len=12) :: labels(size(findings%places))
    character(len=12 * force_parts + 110) :: orders(size(findings%places))
    character(len=:), allocatable :: header, ends
    integer :: i, k

    do i = 1, size(findings%places)
      associate (place => findings%places(i))
        labels(i) = place%name
        values(:2, i) = place%position
        orders(i) = ""
        do k = 1, force_parts
          associate (first => 3 + told * (k - 1))
            values(first:first + told - 1, i) = 0
            if (k /= moment .or. place%turns) then
              values(first:first + told - 1, i) = [place%statistics(k)%peak, place%statistics(k)%peak_error, &
                & place%statistics(k)%rms, place%statistics(k)%crest(), &
                & sign(360.0_dp, findings%speed) * place%statistics(k)%peak_phase]
              orders(i) = trim(orders(i)) // "," // text(place%statistics(k)%strongest())
            else
              orders(i) = trim(orders(i)) // ",0"
            end if
          end associate
        end do
        orders(i) = orders(i)(2:)
        if (place%weighed) orders(i) = trim(orders(i)) // "," // row([place%static, place%least_compression, place%least_error])
      end associate
    end do
    header = "support,x_m,y_m"
    ends = ""
    do k = 1, force_parts
      header = header // told_of(trim(names(k)), trim(units(k)))
      ends = ends // "," // trim(names(k)) // "_strongest_order"
    end do
    if (any(findings%places%weighed)) ends = ends // ",static_fx_N,static_fy_N,least_compression_N,least_compression_error_N"
    call write_table(folder, "supports.csv", preamble, header // ends, values, error, labels=labels, tails=orders)
  end subroutine write_places

  !> The columns of one part.
  pure function told_of(name, unit) result(columns)
    character(len=*), intent(in) :: name, unit
    character(len=:), allocatable :: columns

    columns = "," // name // "_peak_" // unit // "," // name // "_peak_error_" // unit // "," // name // "_rms_" // unit // "," &
      & // name // "_crest," // name // "_peak_crank_deg"
  end function told_of

  subroutine write_histories(folder, preamble, findings, error)
    character(len=*), intent(in) :: folder, preamble(:)
    type(findings_type), intent(in) :: findings
    type(error_type), allocatable, intent(out) :: error
    real(dp), allocatable :: values(:, :)
    character(len=:), allocatable :: header
    integer :: i, k, n

    allocate(values(size(findings%places(1)%history, 1), count_columns(findings%places)))
    header = ""
    n = 0
    do i = 1, size(findings%places)
      do k = 1, force_parts
        if (k == moment .and. .not. findings%places(i)%turns) cycle
        n = n + 1
        values(:, n) = findings%places(i)%history(:, k)
        header = header // "," // column(findings%places(i), k)
      end do
    end do
    call write_turn(folder, "supports_history.csv", preamble, header, findings%speed, findings%period, values, error)
  end subroutine write_histories

  subroutine write_series(folder, preamble, findings, harmonics, error)
    character(len=*), intent(in) :: folder, preamble(:)
    type(findings_type), intent(in) :: findings
    integer, intent(in) :: harmonics
    type(error_type), allocatable, intent(out) :: error
    real(dp), allocatable :: values(:, :)
    character(len=:), allocatable :: header
    integer :: i, k, n

    allocate(values(2 * (count_columns(findings%places) - size(findings%places)), 0:harmonics), source=0.0_dp)
    header = ""
    n = 0
    do i = 1, size(findings%places)
      do k = 1, force_parts
        if (k == whole_force .or. (k == moment .and. .not. findings%places(i)%turns)) cycle
        call add_harmonics(findings%places(i)%statistics(k)%series(1), values, n)
        header = header // "," // column(findings%places(i), k) // "_amplitude," // column(findings%places(i), k) // "_phase_rad"
      end do
    end do
    call write_harmonics(folder, "supports_harmonics.csv", preamble, header, findings%period, values, error)
  end subroutine write_series

  pure integer function count_columns(places)
    type(place_type), intent(in) :: places(:)

    count_columns = (force_parts - 1) * size(places) + count(places%turns)
  end function count_columns

  !> As fx_1_N.
  pure function column(place, part) result(name)
    type(place_type), intent(in) :: place
    integer, intent(in) :: part
    character(len=:), allocatable :: name

    name = trim(names(part)) // "_" // trim(place%name) // "_" // trim(units(part))
  end function column

end module gestell_task_forces_csv
