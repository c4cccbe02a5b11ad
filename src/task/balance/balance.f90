!> The task `balance`: computes how counterweights change the forces on the ground and the vibration. The forces are computed both
!> on rigid ground and for the machine on its mounts.
module gestell_task_balance
  use gestell_base_error, only: error_type, failed_computation, fatal_error
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: either
  use gestell_base_words, only: word_length
  use gestell_base_verdict, only: failed, not_judged, operator(==), unjudged, verdict_type
  use gestell_input_namelist_document, only: group_named
  use gestell_input_namelist_message, only: input_error
  use gestell_input_schema, only: group_rule, schema_type
  use gestell_model_frame, only: dof_names, frame_type
  use gestell_model_frame_shaking, only: moment_point
  use gestell_model_space, only: is_rotation
  use gestell_model_linkage, only: linkage_type
  use gestell_output_result, only: result_type
  use gestell_output_table, only: new_table, table_type
  use gestell_output_table_turn, only: add_order_column
  use gestell_output_table_unit, only: kilogram_metre, metre, newton, newton_metre, radian, unit_type
  use gestell_study_balance, only: examine, rigid_ground_type
  use gestell_task_common_task, only: longest_table, task_type
  use gestell_task_balance_keys, only: balance_keys, balance_options, read_balance
  use gestell_task_balance_plot, only: plot_balance
  use gestell_task_balance_report, only: balance_headlines, link_lines, report_balance, turning_lines
  use gestell_task_balance_variants, only: aims, force, moment, plan_variants, solve_variant, extract_mounted, variant_type
  use gestell_task_common_configuration, only: configuration_type
  use gestell_task_common_context, only: context_type
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite, ieee_quiet_nan, ieee_value
  implicit none (type, external)
  private

  type, extends(task_type), public :: balance_task
    private
    type(balance_options) :: options
  contains
    procedure :: describe, read => read_task, run
    procedure, nopass :: extend
  end type balance_task

  type(unit_type), parameter :: kilogram = unit_type("kg", "kg")
  !> Maximum length of texts in the tables, which are lists of links or names of links and joints
  integer, parameter :: longest = 4 * word_length

contains

  pure subroutine describe(self)
    class(balance_task), intent(inout) :: self

    self%name = "balance"
    self%meaning = "effect of counterweights on the shaking forces and on the vibration"
    self%tables = [character(len=longest_table) :: "balance", "balance_links", "balance_harmonics"]
    self%gives_verdict = .true.
  end subroutine describe

  !> Adds the group &balance to the input schema.
  subroutine extend(schema)
    type(schema_type), intent(inout) :: schema

    call schema%add(group_rule("balance", "for the task `balance`: links that may carry counterweights, and how force and " &
      & // "moment are weighted"), balance_keys)
  end subroutine extend

  !> Reads the group &balance. Fails if the mechanism is not a linkage, or if `read_balance` fails.
  subroutine read_task(self, configuration, error)
    class(balance_task), intent(inout) :: self
    type(configuration_type), intent(inout) :: configuration
    type(error_type), allocatable, intent(out) :: error

    select type (mechanism => configuration%frame%mechanism)
    type is (linkage_type)
      call read_balance(configuration%document, configuration%units, mechanism, self%options, error)
    class default
      if (self%requested) call input_error(group_named(configuration%document, "mass_functions"), "", "the task 'balance' " &
        & // "needs joints and links: a mechanism given by mass functions has no links that could carry counterweights", error)
    end select
    if (allocated(error) .or. .not. self%requested) return
    configuration%analysis%rows = max(configuration%analysis%rows, configuration%force_rows())
  end subroutine read_task

  !> Plans the variants, computes each one on rigid ground and on its mounts, and adds tables, picture and report to `result`.
  subroutine run(self, context, result, error)
    class(balance_task), intent(inout) :: self
    type(context_type), intent(inout) :: context
    type(result_type), intent(inout) :: result
    type(error_type), allocatable, intent(out) :: error
    type(rigid_ground_type) :: rigid
    type(variant_type), allocatable :: variants(:)
    type(error_type), allocatable :: none
    type(table_type) :: table
    real(dp) :: length
    integer :: state, i

    associate (configuration => context%configuration, frame => context%configuration%frame)
      select type (linkage => configuration%frame%mechanism)
      class is (linkage_type)
        call examine(linkage, frame%uniform_in_space(), moment_point(frame, self%options%about_frame), rigid, error, &
          & self%options%links, self%options%radii, frame%space)
        if (allocated(error)) return
        call plan_variants(rigid, linkage, frame%speed, self%options, variants, state, length)
        if (.not. all([(ieee_is_finite(variants(i)%residual%rms) .and. ieee_is_finite(variants(i)%residual%peak), i = 1, &
          & size(variants))])) then
          call fatal_error(error, "the forces of the mechanism overflow double precision", failed_computation)
          return
        end if
        call extract_mounted(context%analysis, configuration%analysis%harmonics, variants(1)%mounted, none)
        do i = 2, size(variants)
          call solve_variant(configuration, linkage, rigid, variants(i))
        end do
        table = table_of(variants, frame%dofs())
        call table%convert(result%units)
        call result%add(table)
        call result%add(links_of(variants, rigid, linkage))
        call result%add(harmonics_of(variants, frame, configuration%analysis%harmonics))
        if (.not. context%is_presented()) return
        call result%add_figure(plot_balance(table, variants))
        call result%warn_each(not_judged, balance_headlines(variants))
        if (.not. context%reports) return
        call result%write_section("BALANCING by counterweights: rms values on rigid ground and on the mounts", &
          & report_balance(variants, rigid, linkage, self%options, state, length))
        if (frame%dofs() > 3) call result%write_lines(turning_lines(variants, frame%shaft_axes, linkage%turns))
        result%report = result%report // link_lines(variants, rigid, linkage, configuration%units)
      end select
    end associate
  end subroutine run

  !> The table balance.csv, which has one row for every variant.
  type(table_type) function table_of(variants, dofs) result(table)
    type(variant_type), intent(in) :: variants(:)
    integer, intent(in) :: dofs
    character(len=*), parameter :: quantities(2) = ["f", "m"]
    type(unit_type), parameter :: units(2) = [newton, newton_metre]
    character(len=longest) :: links(size(variants))
    type(verdict_type) :: verdicts(size(variants))
    real(dp) :: valid(size(variants))
    character(len=:), allocatable :: name
    integer :: i, k, n

    n = size(variants)
    valid = 1
    do i = 1, n
      links(i) = variants(i)%links(" ")
      verdicts(i) = variants(i)%mounted%verdict
      if (verdicts(i) == not_judged) verdicts(i) = failed
      if (allocated(variants(i)%mounted%reason)) valid(i) = ieee_value(1.0_dp, ieee_quiet_nan)
    end do
    table = new_table("balance", "Counterweights", "Force and moment of the machine with counterweights, standing on rigid " &
      & // "ground and on its mounts.", shown=.true.)
    call table%add("aim", "what the counterweights minimise. 'original': machine of the input, without counterweights; " &
      & // "'complete': force cancelled completely", [(aims(variants(i)%aim), i = 1, n)])
    call table%add("links", "links with counterweights", links)
    call table%add("added_mass", kilogram, "mass of the counterweights", [(variants(i)%mass, i = 1, n)])
    do k = force, moment
      name = "rigid_" // quantities(k)
      call table%add(name // "_rms", units(k), "rms on rigid ground", [(variants(i)%residual%rms(k), i = 1, n)])
      call table%add(name // "_peak", units(k), "peak on rigid ground", [(variants(i)%residual%peak(k), i = 1, n)])
    end do
    do k = force, moment
      name = quantities(k)
      call table%add(name // "_rms", units(k), "rms on the mounts", [(valid(i) * variants(i)%mounted%rms(k), &
        & i = 1, n)], bounds=[(valid(i) * variants(i)%mounted%rms_error(k), i = 1, n)])
      call table%add(name // "_peak", units(k), "peak on the mounts", [(valid(i) * variants(i)%mounted%peak(k), &
        & i = 1, n)], bounds=[(valid(i) * variants(i)%mounted%peak_error(k), i = 1, n)])
    end do
    do k = 1, dofs
      call table%add(trim(dof_names(k)) // "_peak", merge(radian, metre, is_rotation(k)), "peak of the vibration", &
        & [(valid(i) * variants(i)%mounted%motion(k), i = 1, n)], bounds=[(valid(i) * variants(i)%mounted%motion_error(k), &
        & i = 1, n)])
    end do
    call table%add("verdict", "verdict on the machine with these counterweights", &
      & verdicts%word())
  end function table_of

  !> The table balance_links.csv, which has one row for every counterweight of every variant.
  type(table_type) function links_of(variants, rigid, linkage) result(table)
    type(variant_type), intent(in) :: variants(:)
    type(rigid_ground_type), intent(in) :: rigid
    class(linkage_type), intent(in) :: linkage
    character(len=longest), allocatable, dimension(:) :: aim, links, name, on, from, to
    real(dp), allocatable :: mass(:), center(:, :), z(:), unbalance(:)
    integer :: i, k, n

    n = sum([(size(variants(i)%weights), i = 1, size(variants))])
    allocate(aim(n), links(n), name(n), on(n), from(n), to(n), mass(n), center(2, n), z(n), unbalance(n))
    n = 0
    do i = 1, size(variants)
      do k = 1, size(variants(i)%weights)
        n = n + 1
        associate (one => variants(i)%weights(k), body => rigid%bodies(variants(i)%weights(k)%body))
          aim(n) = aims(variants(i)%aim)
          links(n) = variants(i)%links(" ")
          name(n) = variants(i)%names(k)
          on(n) = linkage%links(body%link)%name
          from(n) = linkage%joints(linkage%links(body%link)%from)%name
          to(n) = linkage%joints(linkage%links(body%link)%to)%name
          mass(n) = one%mass(body)
          center(:, n) = one%center(body)
          z(n) = linkage%links(body%link)%own_z
          unbalance(n) = one%unbalance
        end associate
      end do
    end do
    table = new_table("balance_links", "Counterweights as links", "Masses and positions of the counterweights.", unjudged, &
      & shown=.true.)
    call table%add("aim", "what the counterweights minimise, as in balance.csv", aim)
    call table%add("links", "links with counterweights, as in balance.csv", links)
    call table%add("name", "name of the &link group that describes the counterweight", name)
    call table%add("on", "link that carries it", on)
    call table%add("from", "joint at the origin of the counterweight's axes", from)
    call table%add("to", "joint to which the counterweight's first axis points", to)
    call table%add("mass", kilogram, "mass of the counterweight (a point mass)", mass)
    call table%add("center_x", metre, "coordinate along the counterweight's first axis", center(1, :))
    call table%add("center_y", metre, "coordinate perpendicular to the counterweight's first axis, positive to the left", &
      & center(2, :))
    if (size(rigid%kinds()) > 3) call table%add("z", metre, "coordinate along the normal of the mechanism's plane", z)
    call table%add("unbalance", kilogram_metre, "mass times distance from the link's pivot on the frame, or from joint 'from' " &
      & // "if there is no such pivot", unbalance)
  end function links_of

  !> The table balance_harmonics.csv, which has one row for each order (up to `orders`) of every variant.
  type(table_type) function harmonics_of(variants, frame, orders) result(table)
    type(variant_type), intent(in) :: variants(:)
    type(frame_type), intent(in) :: frame
    integer, intent(in) :: orders
    character(len=2), parameter :: parts(6) = ["fx", "fy", "fz", "mx", "my", "mz"]
    character(len=*), parameter :: turning(4) = [character(len=14) :: "force_with", "force_against", "moment_with", &
      & "moment_against"]
    character(len=len(aims)) :: aim(orders * size(variants))
    character(len=longest) :: links(orders * size(variants))
    real(dp) :: rms(orders * size(variants), 4), amplitudes(orders * size(variants), 6), rotating(orders * size(variants), 4)
    integer :: number(orders * size(variants)), i, k, n

    amplitudes = 0
    rotating = 0
    n = 0
    do i = 1, size(variants)
      if (frame%dofs() > 3) then
        amplitudes(n + 1:n + orders, :) = variants(i)%residual%amplitudes(orders)
        rotating(n + 1:n + orders, :) = variants(i)%residual%turning(frame%shaft_axes, orders)
      end if
      do k = 1, orders
        n = n + 1
        aim(n) = aims(variants(i)%aim)
        links(n) = variants(i)%links(" ")
        number(n) = k
        rms(n, :2) = [variants(i)%residual%order_rms(k, force), variants(i)%residual%order_rms(k, moment)]
        rms(n, 3:) = variants(i)%mounted%orders(:, k)
        if (allocated(variants(i)%mounted%reason)) rms(n, 3:) = ieee_value(1.0_dp, ieee_quiet_nan)
      end do
    end do
    table = new_table("balance_harmonics", "Counterweights by orders", "Force and moment of the machine with counterweights, " &
      & // "for each order of the crank.")
    call table%add("aim", "what the counterweights minimise, as in balance.csv", aim)
    call table%add("links", "links with counterweights, as in balance.csv", links)
    call add_order_column(table, "order", "multiple of the crank speed", number, frame%mechanism%turns)
    call table%add("rigid_f_rms", newton, "rms of the force on rigid ground, this order only", rms(:, 1))
    call table%add("rigid_m_rms", newton_metre, "rms of the moment on rigid ground, this order only", rms(:, 2))
    call table%add("f_rms", newton, "rms of the force on the mounts, this order only", rms(:, 3))
    call table%add("m_rms", newton_metre, "rms of the moment on the mounts, this order only", rms(:, 4))
    if (frame%dofs() == 3) return
    do i = 1, 6
      call table%add("rigid_" // parts(i), merge(newton, newton_metre, i <= 3), "amplitude on rigid ground", amplitudes(:, i))
    end do
    do i = 1, 4
      call table%add("rigid_" // trim(turning(i)), merge(newton, newton_metre, i <= 2), "force or moment on rigid ground, " &
        & // "normal to the first shaft: magnitude of the vector that rotates " &
        & // either("with the crank", "against the crank", modulo(i, 2) == 1), &
        & rotating(:, i))
    end do
  end function harmonics_of

end module gestell_task_balance
