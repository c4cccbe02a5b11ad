!> Plans variants of a machine that differ in their counterweights, and computes their forces on rigid ground and on the mounts.
module gestell_task_balance_variants
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: text
  use gestell_base_words, only: word_length
  use gestell_base_verdict, only: verdict_type
  use gestell_input_machine_frame, only: read_frame
  use gestell_model_frame, only: frame_type
  use gestell_model_quantity, only: find_quantity
  use gestell_model_quantity_rows, only: force_names, probe_type, quantity_type, rotations_of
  use gestell_model_linkage, only: linkage_type
  use gestell_study_balance, only: residual_shaking_type, measure_residual, rigid_ground_type
  use gestell_study_balance_bodies, only: counterweight_type, with_counterweights
  use gestell_study_balance_complete, only: balance_force, balanced, not_balanced
  use gestell_study_balance_single, only: best_single
  use gestell_study_vibration_analysis, only: analyse, analysis_type, analysis_options
  use gestell_study_vibration_statistics, only: statistics_type, compute_statistics
  use gestell_task_balance_keys, only: balance_options
  use gestell_task_common_configuration, only: configuration_type
  implicit none (type, external)
  private

  public :: plan_variants, solve_variant, extract_mounted

  !> Purpose of the counterweights of a variant. `original_machine`: there are no counterweights. `for_force`, `for_moment`,
  !> `for_sum`: one counterweight minimises the force, the moment or the weighted sum of both. `complete`: several counterweights
  !> make the force vanish. `together`: several counterweights minimise the force, only on links with a pivot on the frame.
  integer, parameter, public :: original_machine = 0, for_force = 1, for_moment = 2, for_sum = 3, complete = 4, together = 5
  character(len=8), parameter, public :: aims(0:5) = [character(len=8) :: "original", &
    & "force", "moment", "sum", "complete", "together"]

  !> Indices of force and moment on the ground in arrays such as `rms`
  integer, parameter, public :: force = 1, moment = 2
  character(len=*), parameter :: quantities(2) = ["total.f", "total.m"]

  !> Forces on the ground and vibration of a variant that stands on its mounts.
  type, public :: mounted_type
    !> Reason why no periodic vibration was computed; not allocated if a vibration was computed
    character(len=:), allocatable :: reason
    !> Verdict on the machine with the counterweights of the variant
    type(verdict_type) :: verdict
    !> Rms and peak, with error bounds, of the force (N, element 1) and of the moment (N m, element 2)
    real(dp), dimension(2) :: rms = 0, rms_error = 0, peak = 0, peak_error = 0
    !> Peaks of the degrees of freedom (m, rad) and their error bounds. Only the first three elements are used for a planar frame
    real(dp), dimension(6) :: motion = 0, motion_error = 0
    !> Rms of force and moment (N, N m) for each of the orders 1, 2, ..., shape (2, orders)
    real(dp), allocatable :: orders(:, :)
  end type mounted_type

  !> One variant of the machine.
  type, public :: variant_type
    !> Purpose of the counterweights: one of the constants `original_machine`, `for_force`, `for_moment`, `for_sum`, `complete`,
    !> `together`
    integer :: aim = original_machine
    !> The counterweights that the variant adds to the machine
    type(counterweight_type), allocatable :: weights(:)
    !> For each counterweight: name of the link that carries it (`on`), and its own name as a link (`names`)
    character(len=word_length), allocatable :: on(:), names(:)
    !> Total mass of the counterweights (kg)
    real(dp) :: mass = 0
    !> Forces and moments that remain on rigid ground
    type(residual_shaking_type) :: residual
    !> Forces on the ground and vibration of the variant on its mounts
    type(mounted_type) :: mounted
  contains
    procedure :: links => links_of, label
  end type variant_type

contains

  !> Plans all variants and computes their forces on rigid ground. The first variant is the original machine. A variant is omitted
  !> if its counterweight would have no effect.
  subroutine plan_variants(rigid, linkage, speed, options, variants, state, length)
    !> Bodies that can carry counterweights, with the effects of these counterweights, and the shaking forces on rigid ground
    type(rigid_ground_type), intent(in) :: rigid
    class(linkage_type), intent(in) :: linkage
    !> Crank speed (rad/s)
    real(dp), intent(in) :: speed
    !> Values of the keys of the group &balance
    type(balance_options), intent(in) :: options
    type(variant_type), allocatable, intent(out) :: variants(:)
    !> Result of `balance_force`: whether counterweights can make the force vanish
    integer, intent(out) :: state
    !> Length (m) by which moments are divided in the weighted sum
    real(dp), intent(out) :: length
    type(variant_type), allocatable :: all(:)
    type(counterweight_type), allocatable :: pivoted(:)
    real(dp) :: weights(size(rigid%found, 1), for_force:for_sum)
    integer :: b, aim, n, k, number, i

    allocate(all(3 + 3 * size(rigid%bodies)))
    allocate(all(1)%weights(0))
    call measure_residual(rigid, all(1)%weights, speed, all(1)%residual)
    length = options%length
    if (.not. length > 0) length = 1
    associate (rms => all(1)%residual%rms)
      if (.not. options%length > 0 .and. minval(rms) > 0) length = rms(moment) / rms(force)
    end associate
    associate (kinds => rigid%kinds())
      weights(:, for_force) = merge(1, 0, kinds == force)
      weights(:, for_moment) = merge(1, 0, kinds == moment)
      weights(:, for_sum) = merge(sqrt(1 - options%weight), sqrt(options%weight) / length, kinds == force)
    end associate
    n = 1
    do b = 1, size(rigid%bodies)
      do aim = for_force, for_sum
        if (allocated(all(n + 1)%weights)) deallocate(all(n + 1)%weights)
        allocate(all(n + 1)%weights(1))
        call best_single(rigid, b, weights(:, aim), all(n + 1)%weights(1))
        if (.not. all(n + 1)%weights(1)%unbalance > 0) cycle
        n = n + 1
        all(n)%aim = aim
      end do
    end do
    if (allocated(all(n + 1)%weights)) deallocate(all(n + 1)%weights)
    call balance_force(rigid, all(n + 1)%weights, state, pivoted)
    if (state == balanced .and. size(pivoted) > 1 .and. count(rigid%kinds() == moment) > 1) then
      ! counterweights on links with a pivot, for example on a shaft with several throws
      n = n + 1
      all(n)%aim = together
      call move_alloc(all(n)%weights, all(n + 1)%weights)
      call move_alloc(pivoted, all(n)%weights)
    end if
    if (state == balanced .or. state == not_balanced .and. count(rigid%bodies%pivoted) > 1 .and. size(all(n + 1)%weights) > 0) then
      n = n + 1
      all(n)%aim = merge(complete, together, state == balanced)
    end if
    do b = 2, n
      call measure_residual(rigid, all(b)%weights, speed, all(b)%residual)
    end do
    allocate(variants, source=all(:n))
    do b = 1, n
      associate (one => variants(b))
        allocate(one%on(size(one%weights)), one%names(size(one%weights)))
        do k = 1, size(one%weights)
          associate (body => rigid%bodies(one%weights(k)%body))
            one%mass = one%mass + one%weights(k)%mass(body)
            one%on(k) = linkage%links(body%link)%name
          end associate
          ! choose a name that no link of the linkage has
          one%names(k) = "counterweight_" // linkage%links(rigid%bodies(one%weights(k)%body)%link)%name
          number = k
          do while (any([(linkage%links(i)%name == one%names(k), i = 1, size(linkage%links))]))
            one%names(k) = "counterweight_" // text(number)
            number = number + size(one%weights)
          end do
        end do
      end associate
    end do
  end subroutine plan_variants

  !> Names of the links that carry counterweights, separated by the text `between`.
  pure function links_of(self, between) result(words)
    class(variant_type), intent(in) :: self
    character(len=*), intent(in) :: between
    character(len=sum(len_trim(self%on)) + max(0, size(self%on) - 1) * len(between)) :: words
    integer :: k, n

    n = 0
    do k = 1, size(self%on)
      words(n + 1:) = trim(self%on(k)) // between
      n = n + len_trim(self%on(k)) + len(between)
    end do
  end function links_of

  !> Name of the variant, for example "crank, for force".
  pure function label(self)
    class(variant_type), intent(in) :: self
    character(len=:), allocatable :: label

    select case (self%aim)
    case (original_machine)
      label = "original"
    case (complete)
      label = "complete"
    case default
      label = self%links(" + ") // ", for " // trim(aims(self%aim))
      if (size(self%weights) > 1) label = trim(aims(self%aim)) // ", for force"
    end select
  end function label

  !> Computes the vibration of the machine with the counterweights of `variant` on its mounts. If there is no vibration,
  !> `mounted%reason` contains the reason.
  subroutine solve_variant(configuration, linkage, rigid, variant)
    !> Configuration from the input file; its linkage is replaced by a linkage with counterweights
    type(configuration_type), intent(in) :: configuration
    class(linkage_type), intent(in) :: linkage
    type(rigid_ground_type), intent(in) :: rigid
    !> The variant with its counterweights. On return it also contains the results on the mounts
    type(variant_type), intent(inout) :: variant
    class(linkage_type), allocatable :: other
    type(frame_type) :: frame
    type(analysis_options) :: options
    type(analysis_type) :: analysis
    type(error_type), allocatable :: failure

    call with_counterweights(linkage, rigid%bodies, variant%weights, variant%names, other, failure)
    if (.not. allocated(failure)) call read_frame(configuration%document, configuration%units, other, frame, failure)
    options = configuration%analysis
    options%rows = configuration%force_rows()
    options%all_vibrations = .false.
    options%modes = .false.
    if (.not. allocated(failure)) call analyse(frame, options, configuration%accuracy, analysis, failure)
    call extract_mounted(analysis, options%harmonics, variant%mounted, failure)
  end subroutine solve_variant

  !> Copies forces and vibration from the results of `analyse` to `mounted`. If `failure` is allocated, its message becomes the
  !> reason why there is no vibration, and `failure` is deallocated.
  subroutine extract_mounted(analysis, orders, mounted, failure)
    type(analysis_type), intent(in) :: analysis
    !> Number of orders whose rms values are copied
    integer, intent(in) :: orders
    type(mounted_type), intent(out) :: mounted
    type(error_type), allocatable, intent(inout) :: failure
    type(quantity_type) :: quantity
    type(statistics_type) :: statistics
    type(probe_type) :: none(0)
    integer :: i, k

    if (allocated(analysis%multipliers)) mounted%verdict = analysis%multipliers%judge()
    allocate(mounted%orders(2, orders), source=0.0_dp)
    do i = force, moment
      if (.not. (allocated(analysis%vibration) .and. .not. allocated(failure))) exit
      call find_quantity(analysis%frame, none, quantities(i), quantity, failure)
      if (i == moment .and. .not. allocated(failure)) call whole_moment(analysis%frame, quantity, failure)
      if (.not. allocated(failure)) call compute_statistics(analysis%vibration, quantity, statistics, failure)
      if (allocated(failure)) exit
      mounted%rms(i) = statistics%rms
      mounted%rms_error(i) = statistics%error
      mounted%peak(i) = statistics%peak
      mounted%peak_error(i) = statistics%peak_error
      mounted%orders(i, :) = [(statistics%amplitude(k) / sqrt(2.0_dp), k = 1, orders)]
    end do
    if (allocated(failure)) then
      mounted%reason = failure%message
      deallocate(failure)
    else if (.not. allocated(analysis%vibration)) then
      mounted%reason = "no periodic vibration"
    else
      associate (dofs => analysis%frame%dofs())
        mounted%motion(:dofs) = analysis%vibration%peak(:dofs)
        mounted%motion_error(:dofs) = analysis%vibration%peak_error(:dofs)
      end associate
    end if
  end subroutine extract_mounted

  !> Extends `quantity`, the moment about zeta, to the moments about all axes about which the frame rotates. Fails if
  !> `find_quantity` fails.
  subroutine whole_moment(frame, quantity, error)
    class(frame_type), intent(in) :: frame
    type(quantity_type), intent(inout) :: quantity
    type(error_type), allocatable, intent(out) :: error
    type(quantity_type) :: other
    type(probe_type) :: none(0)
    real(dp), allocatable :: weights(:, :), rounding(:, :)
    integer, allocatable :: axes(:)
    integer :: i

    axes = rotations_of(frame)
    allocate(weights(size(quantity%weights, 1), size(axes)), rounding(size(quantity%rounding, 1), size(axes)))
    do i = 1, size(axes)
      call find_quantity(frame, none, "total." // trim(force_names(axes(i))), other, error)
      if (allocated(error)) return
      weights(:, i) = other%weights(:, 1)
      rounding(:, i) = other%rounding(:, 1)
    end do
    call move_alloc(weights, quantity%weights)
    call move_alloc(rounding, quantity%rounding)
  end subroutine whole_moment

end module gestell_task_balance_variants
