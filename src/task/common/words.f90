!> Explains the values of those keys that several tasks share. Help and manual print these explanations.
module gestell_task_common_words
  use gestell_base_text, only: text
  use gestell_floquet_solution_part, only: solution_methods
  use gestell_input_schema, only: variant_type
  implicit none (type, external)
  private

  public :: shared_words, task_words

  type(variant_type), parameter :: model_words(*) = [ &
    & variant_type("model", "frame", "exact", "nonlinear equations, valid for any rotation of the frame; they give the " // &
    &   "vibration and, linearised about it, the stability. Exit code 4 if Newton's method finds no vibration"), &
    & variant_type("model", "frame", "first_order", "equations linearised about rest give the vibration; the exact equations, " // &
    &   "linearised about this vibration, give the stability"), &
    & variant_type("model", "frame", "rest", "equations linearised about rest give the vibration and the stability; " // &
    &   "suitable for charts that must be fast")]

contains

  !> Explains the values of the keys of &model and &accuracy.
  pure function shared_words() result(words)
    type(variant_type), allocatable :: words(:)
    character(len=16), allocatable :: methods(:)
    integer :: i

    methods = solution_methods()
    words = [model_words, (variant_type("accuracy", "method", methods(i), meaning_of(trim(methods(i)))), i = 1, size(methods))]
  end function shared_words

  !> Explains the values of the key `case.tasks`, which are the tasks that an input can request.
  pure function task_words(tasks, meanings) result(words)
    !> Names of the tasks, and for each task a sentence that explains what it computes
    character(len=*), intent(in) :: tasks(:), meanings(:)
    type(variant_type) :: words(size(tasks))
    integer :: i

    words = [(variant_type("case", "tasks", tasks(i), meanings(i)), i = 1, size(tasks))]
  end function task_words

  !> Sentence that explains a value of `accuracy.method`; blank if the method is unknown.
  pure character(len=320) function meaning_of(method) result(meaning)
    character(len=*), intent(in) :: method
    integer :: stages, status

    select case (method)
    case ("auto")
      meaning = "the method that the program expects to meet the tolerance with the least work; `'gauss6'` if `steps` is given"
    case ("rk4")
      meaning = "the classical explicit Runge-Kutta method of order 4"
    case ("explicit8")
      meaning = "explicit Runge-Kutta method of order 8"
    case ("magnus4", "magnus6")
      meaning = "Magnus expansion of order " // method(7:) // ": exponentials of matrices, exact for constant coefficients"
    case ("reduced")
      meaning = "replaces fast free vibrations by slowly varying modes; the key `steps` is not allowed. Exit code 4 if the " // &
        &   "free vibrations are too slow for this method"
    case default
      meaning = ""
      if (index(method, "gauss") /= 1) return
      read(method(6:), *, iostat=status) stages
      if (status == 0) meaning = "Gauss collocation with " // text(stages) // " stages, order " // text(2 * stages)
    end select
  end function meaning_of

end module gestell_task_common_words
