/* What is asked of MPI and PETSc, in C, where their macros and types belong. All functions are called by
 * every rank together, except where they say otherwise, and return 0, or an error after which the job
 * must end. A preparation or a solve that does not succeed is no error: it is told by `reason`. */

#include <petscksp.h>
#include <time.h>

_Static_assert(sizeof(PetscInt) == sizeof(int), "PETSc with 32-bit indices is expected");
_Static_assert(sizeof(PetscScalar) == sizeof(double), "PETSc with real numbers is expected");

/* Largest piece of one message: MPI counts in int. */
#define PIECE ((size_t)1 << 30)

static Mat matrix;
static KSP solver;
static Vec right, left;
static int my_rank, is_over;
static const int *cancelled;
static double goal;

/* Starts MPI and PETSc; `options` are read as from PETSc's command line. */
int sg_start(const char *options, int *rank, int *size) {
    int provided;
    if (MPI_Init_thread(NULL, NULL, MPI_THREAD_FUNNELED, &provided) != MPI_SUCCESS) return 1;
    PetscCall(PetscInitializeNoArguments());
    PetscCall(PetscPushErrorHandler(PetscReturnErrorHandler, NULL));
    PetscCall(PetscOptionsInsertString(NULL, options));
    if (MPI_Comm_rank(PETSC_COMM_WORLD, rank) || MPI_Comm_size(PETSC_COMM_WORLD, size)) return 1;
    my_rank = *rank;
    return 0;
}

int sg_end(void) {
    PetscCall(PetscFinalize());
    return MPI_Finalize();
}

/* Ends all ranks at once; called by one. */
void sg_abort(void) { MPI_Abort(MPI_COMM_WORLD, 1); }

/* Rank 0 tells all others a number; they sleep until it comes, so that an idle job takes no processor. */
int sg_tell(long long *number) {
    MPI_Request request;
    const struct timespec pause = {0, 1000000};
    int is_done = 0;
    if (MPI_Ibcast(number, 1, MPI_LONG_LONG, 0, PETSC_COMM_WORLD, &request)) return 1;
    if (my_rank == 0) return MPI_Wait(&request, MPI_STATUS_IGNORE);
    for (;;) {
        if (MPI_Test(&request, &is_done, MPI_STATUS_IGNORE)) return 1;
        if (is_done) return 0;
        nanosleep(&pause, NULL);
    }
}

/* Bytes from rank 0 to another; called by these two. */
int sg_send(int to, const char *bytes, size_t len) {
    for (size_t at = 0; at < len; at += PIECE) {
        const size_t piece = len - at < PIECE ? len - at : PIECE;
        if (MPI_Send(bytes + at, (int)piece, MPI_BYTE, to, 1, PETSC_COMM_WORLD)) return 1;
    }
    return 0;
}

int sg_receive(char *bytes, size_t len) {
    for (size_t at = 0; at < len; at += PIECE) {
        const size_t piece = len - at < PIECE ? len - at : PIECE;
        if (MPI_Recv(bytes + at, (int)piece, MPI_BYTE, 0, 1, PETSC_COMM_WORLD, MPI_STATUS_IGNORE))
            return 1;
    }
    return 0;
}

int sg_sum(double *values, int count) {
    return MPI_Allreduce(MPI_IN_PLACE, values, count, MPI_DOUBLE, MPI_SUM, PETSC_COMM_WORLD);
}

/* The largest; of values among which one is not a number, any. */
int sg_max(double *values, int count) {
    return MPI_Allreduce(MPI_IN_PLACE, values, count, MPI_DOUBLE, MPI_MAX, PETSC_COMM_WORLD);
}

int sg_xor(unsigned long long *value) {
    return MPI_Allreduce(MPI_IN_PLACE, value, 1, MPI_UNSIGNED_LONG_LONG, MPI_BXOR, PETSC_COMM_WORLD);
}

int sg_drop(void) {
    PetscCall(KSPDestroy(&solver));
    PetscCall(MatDestroy(&matrix));
    PetscCall(VecDestroy(&right));
    PetscCall(VecDestroy(&left));
    return 0;
}

static PetscErrorCode know_rigid_motions(int nodes, const double *places) {
    MatNullSpace motions;
    Vec at;
    double *values;
    PetscCall(VecCreate(PETSC_COMM_WORLD, &at));
    PetscCall(VecSetBlockSize(at, 3));
    PetscCall(VecSetSizes(at, 3 * nodes, PETSC_DECIDE));
    PetscCall(VecSetType(at, VECSTANDARD));
    PetscCall(VecGetArray(at, &values));
    for (int i = 0; i < 3 * nodes; i++) values[i] = places[i];
    PetscCall(VecRestoreArray(at, &values));
    PetscCall(MatNullSpaceCreateRigidBody(at, &motions));
    PetscCall(MatSetNearNullSpace(matrix, motions));
    PetscCall(MatNullSpaceDestroy(&motions));
    PetscCall(VecDestroy(&at));
    return 0;
}

/* The rows of this rank's nodes, the first of which has number `first`: blocks of 3 x 3, row by row, and
 * the numbers of their nodes. */
int sg_new(int nodes, int first, const unsigned long long *row_start, const int *columns,
           const double *blocks, const double *places) {
    PetscInt *inside, *outside, longest = 0;
    double *values;
    PetscCall(sg_drop());
    PetscCall(PetscMalloc2(nodes, &inside, nodes, &outside));
    for (int row = 0; row < nodes; row++) {
        inside[row] = outside[row] = 0;
        for (unsigned long long at = row_start[row]; at < row_start[row + 1]; at++) {
            const int is_own = columns[at] >= first && columns[at] < first + nodes;
            if (is_own) inside[row]++; else outside[row]++;
        }
        if (inside[row] + outside[row] > longest) longest = inside[row] + outside[row];
    }
    PetscCall(MatCreate(PETSC_COMM_WORLD, &matrix));
    PetscCall(MatSetSizes(matrix, 3 * nodes, 3 * nodes, PETSC_DETERMINE, PETSC_DETERMINE));
    PetscCall(MatSetType(matrix, MATAIJ));
    PetscCall(MatSetBlockSize(matrix, 3));
    PetscCall(MatXAIJSetPreallocation(matrix, 3, inside, outside, NULL, NULL));
    PetscCall(MatSetOption(matrix, MAT_NO_OFF_PROC_ENTRIES, PETSC_TRUE));
    PetscCall(PetscMalloc1(9 * (size_t)longest, &values));
    for (int row = 0; row < nodes; row++) {
        const unsigned long long start = row_start[row];
        const PetscInt count = (PetscInt)(row_start[row + 1] - start), number = first + row;
        for (PetscInt j = 0; j < count; j++)
            for (int r = 0; r < 3; r++)
                for (int c = 0; c < 3; c++)
                    values[3 * count * r + 3 * j + c] = blocks[9 * (start + j) + 3 * r + c];
        PetscCall(MatSetValuesBlocked(matrix, 1, &number, count, columns + start, values,
                                      INSERT_VALUES));
    }
    PetscCall(PetscFree(values));
    PetscCall(PetscFree2(inside, outside));
    PetscCall(MatAssemblyBegin(matrix, MAT_FINAL_ASSEMBLY));
    PetscCall(MatAssemblyEnd(matrix, MAT_FINAL_ASSEMBLY));
    PetscCall(MatCreateVecs(matrix, &left, &right));
    return know_rigid_motions(nodes, places);
}

/* Makes the rows and columns of this rank's held degrees of freedom those of the identity times `scale`. */
int sg_hold(int count, const int *dofs, double scale) {
    PetscCall(MatSetOption(matrix, MAT_NO_OFF_PROC_ZERO_ROWS, PETSC_TRUE));
    PetscCall(MatZeroRowsColumns(matrix, count, dofs, scale, NULL, NULL));
    PetscCall(MatSetOption(matrix, MAT_SPD, PETSC_TRUE));
    return 0;
}

static PetscErrorCode judge(KSP ksp, PetscInt step, PetscReal residual, KSPConvergedReason *reason,
                            void *context) {
    PetscInt most;
    (void)context;
    is_over = my_rank == 0 && cancelled != NULL && *(const volatile int *)cancelled;
    if (MPI_Bcast(&is_over, 1, MPI_INT, 0, PETSC_COMM_WORLD)) return 1;
    PetscCall(KSPGetTolerances(ksp, NULL, NULL, NULL, &most));
    *reason = KSP_CONVERGED_ITERATING;
    if (PetscIsInfOrNanReal(residual)) *reason = KSP_DIVERGED_NANORINF;
    else if (residual <= goal) *reason = KSP_CONVERGED_RTOL;
    else if (is_over || step >= most) *reason = KSP_DIVERGED_ITS;
    return 0;
}

static PetscErrorCode factor_by_mumps(PC pc, int megabytes) {
    Mat factor;
    PetscCall(KSPSetType(solver, KSPPREONLY));
    PetscCall(PCSetType(pc, PCCHOLESKY));
    PetscCall(PCFactorSetMatSolverType(pc, MATSOLVERMUMPS));
    PetscCall(PCFactorSetUpMatSolverType(pc));
    PetscCall(PCFactorGetMatrix(pc, &factor));
    PetscCall(MatMumpsSetIcntl(factor, 28, 1));
    PetscCall(MatMumpsSetIcntl(factor, 23, megabytes));
    return 0;
}

/* Prepares to solve: `kind` 0 multigrid by GAMG, 1 multigrid by hypre, 2 factor by MUMPS within so many
 * megabytes on each rank. `failed` is not 0 where that did not succeed. */
int sg_prepare(int kind, int megabytes, int *failed) {
    PC pc;
    PCFailedReason why = PC_NOERROR;
    PetscCall(KSPDestroy(&solver));
    PetscCall(KSPCreate(PETSC_COMM_WORLD, &solver));
    PetscCall(KSPSetOperators(solver, matrix, matrix));
    PetscCall(KSPGetPC(solver, &pc));
    if (kind == 2) {
        PetscCall(factor_by_mumps(pc, megabytes));
    } else {
        PetscCall(KSPSetType(solver, KSPCG));
        PetscCall(KSPSetNormType(solver, KSP_NORM_UNPRECONDITIONED));
        PetscCall(KSPSetConvergenceTest(solver, judge, NULL, NULL));
        PetscCall(PCSetType(pc, kind == 0 ? PCGAMG : PCHYPRE));
    }
    PetscCall(KSPSetFromOptions(solver));
    PetscCall(KSPSetUp(solver));
    PetscCall(PCGetFailedReason(pc, &why));
    *failed = why != PC_NOERROR;
    return MPI_Allreduce(MPI_IN_PLACE, failed, 1, MPI_INT, MPI_MAX, PETSC_COMM_WORLD);
}

static PetscErrorCode copied(Vec to, const double *from, int count) {
    double *values;
    PetscCall(VecGetArray(to, &values));
    for (int i = 0; i < count; i++) values[i] = from[i];
    PetscCall(VecRestoreArray(to, &values));
    return 0;
}

/* Solves for the right-hand side b, of this rank's degrees of freedom, until the residual is `tolerance`
 * times b, or until rank 0 sees `stop` set. `reason` is above 0 where that was reached, `over` is not 0
 * where it was stopped. */
int sg_solve(int count, const double *b, double *x, double tolerance, int most, const int *stop,
             int *steps, int *reason, int *over) {
    const double *found;
    double norm;
    KSPConvergedReason why;
    PetscCall(copied(right, b, count));
    PetscCall(VecNorm(right, NORM_2, &norm));
    goal = tolerance * norm;
    cancelled = stop;
    is_over = 0;
    PetscCall(KSPSetTolerances(solver, tolerance, 0.0, PETSC_DEFAULT, most));
    PetscCall(KSPSolve(solver, right, left));
    PetscCall(KSPGetConvergedReason(solver, &why));
    PetscCall(KSPGetIterationNumber(solver, steps));
    *reason = (int)why;
    *over = is_over;
    cancelled = NULL;
    PetscCall(VecGetArrayRead(left, &found));
    for (int i = 0; i < count; i++) x[i] = found[i];
    PetscCall(VecRestoreArrayRead(left, &found));
    return 0;
}

/* Each rank reads `count` entries of a vector of which all have a part; `dofs` are numbers in it. */
int sg_read(int own_count, const double *own, int count, const int *dofs, double *read) {
    IS from;
    Vec whole, wanted;
    VecScatter scatter;
    const double *found;
    PetscCall(VecCreate(PETSC_COMM_WORLD, &whole));
    PetscCall(VecSetSizes(whole, own_count, PETSC_DECIDE));
    PetscCall(VecSetType(whole, VECSTANDARD));
    PetscCall(copied(whole, own, own_count));
    PetscCall(VecCreateSeq(PETSC_COMM_SELF, count, &wanted));
    PetscCall(ISCreateGeneral(PETSC_COMM_SELF, count, dofs, PETSC_USE_POINTER, &from));
    PetscCall(VecScatterCreate(whole, from, wanted, NULL, &scatter));
    PetscCall(VecScatterBegin(scatter, whole, wanted, INSERT_VALUES, SCATTER_FORWARD));
    PetscCall(VecScatterEnd(scatter, whole, wanted, INSERT_VALUES, SCATTER_FORWARD));
    PetscCall(VecGetArrayRead(wanted, &found));
    for (int i = 0; i < count; i++) read[i] = found[i];
    PetscCall(VecRestoreArrayRead(wanted, &found));
    PetscCall(VecScatterDestroy(&scatter));
    PetscCall(ISDestroy(&from));
    PetscCall(VecDestroy(&wanted));
    PetscCall(VecDestroy(&whole));
    return 0;
}
