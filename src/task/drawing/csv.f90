!> mechanism.csv: a linkage through a turn of its crank.
module gestell_task_drawing_csv
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_output_table_csv, only: field, write_table
  use gestell_task_drawing_plot, only: plot_mechanism
  use gestell_model_frame, only: frame_type
  use gestell_model_linkage, only: linkage_type
  use gestell_model_frame_quantity, only: probe_type
  use gestell_model_linkage_skeleton, only: skeleton_type, trace_skeleton
  implicit none (type, external)
  private

  public :: write_mechanism

  !> Rows of a turn, less the last, which repeats the first.
  integer, parameter :: rows = 360

contains

  !> Writes the places of all joints and centres of mass, in the frame's system, and the script that draws them with the
  !> probes, into `folder`; `preamble` heads the file. A mechanism that is no linkage has none, and nothing is written.
  !> Error: a file cannot be written.
  subroutine write_mechanism(folder, preamble, frame, probes, error)
    character(len=*), intent(in) :: folder, preamble(:)
    class(frame_type), intent(in) :: frame
    type(probe_type), intent(in) :: probes(:)
    type(error_type), allocatable, intent(out) :: error
    type(skeleton_type) :: skeleton
    real(dp), allocatable :: values(:, :)
    character(len=:), allocatable :: header
    integer :: i, k, joints, links

    select type (mechanism => frame%mechanism)
    class is (linkage_type)
      call trace_skeleton(mechanism, [(sign(2 * pi, frame%speed) * k / rows, k = 0, rows)], skeleton)
      joints = size(mechanism%joints)
      links = size(mechanism%links)
      header = "crank_deg"
      do i = 1, joints
        header = header // "," // field("joint(" // mechanism%joints(i)%name // ").x_m") // "," &
          & // field("joint(" // mechanism%joints(i)%name // ").y_m")
      end do
      do i = 1, links
        header = header // "," // field("link(" // mechanism%links(i)%name // ").x_m") // "," &
          & // field("link(" // mechanism%links(i)%name // ").y_m")
      end do
      do i = 1, 2
        skeleton%joints(i, :, :) = skeleton%joints(i, :, :) + frame%origin(i)
        skeleton%centers(i, :, :) = skeleton%centers(i, :, :) + frame%origin(i)
      end do
      allocate(values(1 + 2 * (joints + links), rows + 1))
      values(1, :) = [(sign(360.0_dp, frame%speed) * k / rows, k = 0, rows)]
      values(2:1 + 2 * joints, :) = reshape(skeleton%joints, [2 * joints, rows + 1])
      values(2 + 2 * joints:, :) = reshape(skeleton%centers, [2 * links, rows + 1])
      call write_table(folder, "mechanism.csv", preamble, header, values, error)
      if (.not. allocated(error)) call plot_mechanism(folder, preamble, frame, mechanism, skeleton, probes, error)
    end select
  end subroutine write_mechanism

end module gestell_task_drawing_csv
