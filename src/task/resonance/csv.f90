!> resonance.csv and peaks.csv.
module gestell_task_resonance_csv
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: exact, text
  use gestell_output_table_csv, only: field, write_table
  use gestell_task_resonance_plot, only: plot_peaks, plot_resonance
  use gestell_model_frame_quantity, only: quantity_type
  use gestell_task_resonance_curve, only: resonance_curve_type
  use gestell_study_speed_point, only: state_names, unreached
  implicit none (type, external)
  private

  public :: column_unit, write_resonance

contains

  !> Writes the curve and the list of its maxima into `folder`, with their scripts for gnuplot; `preamble` heads the files.
  !> Error: one cannot be written.
  subroutine write_resonance(folder, preamble, quantities, curve, error)
    character(len=*), intent(in) :: folder, preamble(:)
    type(quantity_type), intent(in) :: quantities(:)
    type(resonance_curve_type), intent(in) :: curve
    type(error_type), allocatable, intent(out) :: error

    call write_curve(folder, preamble, quantities, curve, error)
    if (.not. allocated(error)) call write_peaks(folder, preamble, quantities, curve, error)
    if (.not. allocated(error)) call plot_resonance(folder, preamble, quantities, curve, error)
    if (.not. allocated(error)) call plot_peaks(folder, preamble, quantities, curve, error)
  end subroutine write_resonance

  subroutine write_curve(folder, preamble, quantities, curve, error)
    character(len=*), intent(in) :: folder, preamble(:)
    type(quantity_type), intent(in) :: quantities(:)
    type(resonance_curve_type), intent(in) :: curve
    type(error_type), allocatable, intent(out) :: error
    character(len=:), allocatable :: header, name, unit
    character(len=48), allocatable :: labels(:)
    character(len=3), allocatable :: tails(:)
    real(dp), allocatable :: values(:, :)
    integer :: i, k, columns

    columns = 3 + curve%order%orders
    header = "speed_rpm,state,refined"
    do i = 1, size(quantities)
      name = trim(quantities(i)%name)
      unit = column_unit(quantities(i)%unit)
      call add(header, name // "_peak_" // unit)
      call add(header, name // "_peak_error_" // unit)
      call add(header, name // "_rms_" // unit)
      do k = 1, curve%order%orders
        call add(header, name // "_order_" // text(k) // "_" // unit)
      end do
    end do
    call add(header, "small_motion")
    allocate(labels(size(curve%points)), tails(size(curve%points)), values(columns * size(quantities), size(curve%points)))
    do i = 1, size(curve%points)
      associate (point => curve%points(i))
        labels(i) = exact(point%speed) // "," // trim(state_names(point%state)) // "," // merge("1", "0", point%refined)
        values(:, i) = reshape(point%values, [size(point%values)])
        tails(i) = merge(merge("1  ", "0  ", point%moved%small()), "NaN", point%state <= unreached)
      end associate
    end do
    call write_table(folder, "resonance.csv", preamble, header, values, error, labels=labels, tails=tails)
  end subroutine write_curve

  !> A further column.
  subroutine add(header, name)
    character(len=:), allocatable, intent(inout) :: header
    character(len=*), intent(in) :: name
    character(len=:), allocatable :: column

    column = field(name)
    header = header // "," // column
  end subroutine add

  subroutine write_peaks(folder, preamble, quantities, curve, error)
    character(len=*), intent(in) :: folder, preamble(:)
    type(quantity_type), intent(in) :: quantities(:)
    type(resonance_curve_type), intent(in) :: curve
    type(error_type), allocatable, intent(out) :: error
    character(len=:), allocatable :: name
    character(len=192), allocatable :: labels(:)
    character(len=24), allocatable :: tails(:)
    real(dp), allocatable :: values(:, :)
    integer :: i

    allocate(labels(size(curve%maxima)), tails(size(curve%maxima)), values(4, size(curve%maxima)))
    do i = 1, size(curve%maxima)
      associate (maximum => curve%maxima(i), quantity => quantities(curve%maxima(i)%quantity))
        name = field(trim(quantity%name))
        labels(i) = name // "," // trim(quantity%unit)
        values(:, i) = [maximum%speed, maximum%value, maximum%width, maximum%damping_ratio]
        tails(i) = text(maximum%strongest_order) // "," // trim(state_names(maximum%state))
        if (maximum%unbounded) tails(i) = text(maximum%strongest_order) // ",unbounded"
        tails(i) = trim(tails(i)) // "," // merge("1", "0", maximum%small)
      end associate
    end do
    call write_table(folder, "peaks.csv", preamble, "quantity,unit,speed_rpm,value,width_rpm,damping_ratio,strongest_order," &
      & // "state,small_motion", values, error, labels=labels, tails=tails)
  end subroutine write_peaks

  !> A unit as a part of a header: m/s^2 becomes m_s2.
  pure function column_unit(unit) result(column)
    character(len=*), intent(in) :: unit
    character(len=:), allocatable :: column
    integer :: i

    column = ""
    do i = 1, len_trim(unit)
      if (unit(i:i) == "/") then
        column = column // "_"
      else if (unit(i:i) /= "^") then
        column = column // unit(i:i)
      end if
    end do
  end function column_unit

end module gestell_task_resonance_csv
