!> The result files of one machine, columns as the manual's page on the output lists them.
module gestell_task_results
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_floquet_multipliers, only: multipliers_type
  use gestell_base_text, only: exact, text
  use gestell_output_table_csv, only: write_table
  use gestell_task_stability_plot, only: plot_modes, plot_multipliers
  use gestell_task_trade_plot, only: plot_trade
  use gestell_task_response_plot, only: plot_harmonics, plot_response
  use gestell_task_report_several, only: write_several
  use gestell_model_frame, only: frame_type
  use gestell_study_vibration_analysis, only: analysis_type, tasks_type
  use gestell_task_trade_model_trade, only: model_trade_type
  use gestell_task_trade, only: trade_type
  use gestell_study_vibration, only: quantities, vibration_type
  implicit none (type, external)
  private

  public :: write_results, write_trade

  character(len=*), parameter :: columns(quantities) = [character(len=13) :: &
    & "xi_m", "eta_m", "psi_rad", "xi_dot_m_s", "eta_dot_m_s", "psi_dot_rad_s", "fx_N", "fy_N", "m_Nm"]

contains

  !> Writes the files of what was asked for into `folder`, each with its script for gnuplot; `preamble` heads each.
  !> Error: a file cannot be written.
  subroutine write_results(folder, preamble, frame, tasks, analysis, error)
    character(len=*), intent(in) :: folder, preamble(:)
    class(frame_type), intent(in) :: frame
    type(tasks_type), intent(in) :: tasks
    type(analysis_type), intent(in) :: analysis
    type(error_type), allocatable, intent(out) :: error

    if (tasks%stability .or. tasks%modes) then
      call write_multipliers(folder, preamble, analysis%multipliers, error)
      if (.not. allocated(error)) call plot_multipliers(folder, preamble, frame, analysis%multipliers, error)
      if (.not. allocated(error) .and. tasks%modes) then
        call write_modes(folder, preamble, frame, analysis%multipliers, error)
        if (.not. allocated(error)) call plot_modes(folder, preamble, frame, analysis%multipliers, error)
      end if
      if (allocated(error)) return
    end if
    if (allocated(analysis%several)) call write_several(folder, preamble, analysis%several, error)
    if (allocated(error)) return
    if (allocated(analysis%vibration) .and. tasks%response) then
      call write_history(folder, preamble, frame, analysis%vibration, error)
      if (.not. allocated(error)) call plot_response(folder, preamble, frame, analysis%vibration, error)
      if (.not. allocated(error)) call write_harmonics(folder, preamble, frame, tasks%harmonics, analysis%vibration, error)
      if (.not. allocated(error)) call plot_harmonics(folder, preamble, frame, tasks%harmonics, analysis%vibration, error)
    end if
  end subroutine write_results

  subroutine write_multipliers(folder, preamble, multipliers, error)
    character(len=*), intent(in) :: folder, preamble(:)
    type(multipliers_type), intent(in) :: multipliers
    type(error_type), allocatable, intent(out) :: error
    real(dp) :: values(8, size(multipliers%rho))
    character :: lost(size(multipliers%rho))

    associate (m => multipliers)
      values(1, :) = real(m%rho)
      values(2, :) = aimag(m%rho)
      values(3, :) = abs(m%rho)
      values(4, :) = m%log_abs
      values(5, :) = m%arg
      values(6, :) = real(m%exponent)
      values(7, :) = aimag(m%exponent)
      values(8, :) = m%error
      lost = merge("1", "0", m%lost())
    end associate
    call write_table(folder, "multipliers.csv", preamble, &
      & "index,re,im,abs,log_abs,arg_rad,exponent_re_per_s,exponent_im_rad_per_s,error,lost", values, error, first_index=1, &
      & tails=lost)
  end subroutine write_multipliers

  !> Eigenvectors of (19) at t = 0; degrees of freedom that are not free have zeros.
  subroutine write_modes(folder, preamble, frame, multipliers, error)
    character(len=*), intent(in) :: folder, preamble(:)
    class(frame_type), intent(in) :: frame
    type(multipliers_type), intent(in) :: multipliers
    type(error_type), allocatable, intent(out) :: error
    complex(dp) :: vectors(6, size(multipliers%rho))
    real(dp) :: values(12, size(multipliers%rho))
    integer :: f

    f = size(frame%free)
    vectors = 0
    vectors(frame%free, :) = multipliers%vectors(:f, :)
    vectors(3 + frame%free, :) = multipliers%vectors(f + 1:, :)
    values(1::2, :) = real(vectors)
    values(2::2, :) = aimag(vectors)
    call write_table(folder, "modes.csv", preamble, "index,xi_re,xi_im,eta_re,eta_im,psi_re,psi_im," // &
      & "xi_dot_re,xi_dot_im,eta_dot_re,eta_dot_im,psi_dot_re,psi_dot_im", values, error, first_index=1)
  end subroutine write_modes

  subroutine write_history(folder, preamble, frame, vibration, error)
    character(len=*), intent(in) :: folder, preamble(:)
    class(frame_type), intent(in) :: frame
    type(vibration_type), intent(in) :: vibration
    type(error_type), allocatable, intent(out) :: error
    real(dp), allocatable :: values(:, :)
    character(len=:), allocatable :: header
    integer :: k, points

    points = size(vibration%history, 2) - 1
    allocate(values(2 + quantities, points + 1))
    values(1, :) = [(sign(360.0_dp, frame%speed) * k / points, k = 0, points)]
    values(2, :) = [(frame%period * k / points, k = 0, points)]
    values(3:, :) = vibration%history
    header = "crank_deg,t_s"
    do k = 1, quantities
      header = header // "," // trim(columns(k))
    end do
    call write_table(folder, "response.csv", preamble, header, values, error)
  end subroutine write_history

  !> Order 0 is the mean, with its sign; f = mean + sum of amplitude cos(order |Omega| t + phase).
  subroutine write_harmonics(folder, preamble, frame, harmonics, vibration, error)
    character(len=*), intent(in) :: folder, preamble(:)
    class(frame_type), intent(in) :: frame
    integer, intent(in) :: harmonics
    type(vibration_type), intent(in) :: vibration
    type(error_type), allocatable, intent(out) :: error
    real(dp), allocatable :: values(:, :)
    character(len=:), allocatable :: header
    integer :: i, k

    allocate(values(1 + 2 * quantities, 0:harmonics), source=0.0_dp)
    values(1, :) = [(k / frame%period, k = 0, harmonics)]
    header = "order,frequency_Hz"
    do i = 1, quantities
      header = header // "," // trim(columns(i)) // "_amplitude," // trim(columns(i)) // "_phase_rad"
      values(2 * i, 0) = vibration%series(i)%mean
      values(2 * i, 1:) = vibration%series(i)%amplitude(:harmonics)
      values(2 * i + 1, 1:) = vibration%series(i)%phase(:harmonics)
    end do
    call write_table(folder, "harmonics.csv", preamble, header, values, error, first_index=0)
  end subroutine write_harmonics

  !> The measured trade of speed for accuracy, and as last row the averaged model, where it has a periodic vibration. The
  !> preamble also says what the converged solution claims for itself.
  subroutine write_trade(folder, preamble, trade, model, error)
    character(len=*), intent(in) :: folder, preamble(:)
    type(trade_type), intent(in) :: trade
    type(model_trade_type), intent(in) :: model
    type(error_type), allocatable, intent(out) :: error
    character(len=max(len(preamble), 120)) :: lines(size(preamble) + 1)
    character(len=48), allocatable :: labels(:)
    real(dp), allocatable :: values(:, :)
    integer :: i, n

    lines(:size(preamble)) = preamble
    lines(size(lines)) = "errors of the converged solution: phi " // exact(trade%floor_phi) // " rho " // exact(trade%floor_rho) &
      & // " x0 " // exact(trade%floor_x0)
    n = size(trade%rows)
    allocate(labels(n + 1), values(4, n + 1))
    do i = 1, n
      associate (row => trade%rows(i))
        values(:, i) = [row%error_phi, row%error_rho, row%error_x0, row%seconds]
        labels(i) = trim(row%method) // "," // text(row%order) // "," // text(row%steps) // "," // text(row%evaluations)
      end associate
    end do
    if (.not. allocated(model%resonance)) then
      n = n + 1
      values(:, n) = [model%error_phi, model%error_rho, model%error_x0, model%averaged%seconds]
      labels(n) = "averaged,0,0," // text(model%evaluations)
    end if
    call write_table(folder, "trade.csv", lines, &
      & "method,order,steps,evaluations,error_phi,error_rho,error_x0,seconds", values(:, :n), error, labels=labels(:n))
    if (.not. allocated(error)) call plot_trade(folder, preamble, trade, n > size(trade%rows), error)
  end subroutine write_trade

end module gestell_task_results
