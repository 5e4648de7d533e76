//! One request whose element, method or precision the server chooses, by deadline, error budget,
//! material and memory.

use softgrasp_core::fem::Element;
use softgrasp_core::model::{Model, ModelError};
use softgrasp_core::solve::choose::{
    Choice, ElementWish, GaveUp, LOCKING_POISSON, Offer, Wish, cheapest_element, choose, offers,
    offers_after_order,
};
use softgrasp_core::solve::memory::{Need, Way};
use softgrasp_core::solve::rates::Rates;
use softgrasp_core::solve::work::Work;
use softgrasp_core::solve::{Analysed, Factored, FrontMethod, Method, Solution, SolveError};
use softgrasp_protocol::{
    Answer, ElementChoice, ElementName, Material, MeshData, Question, SolveReport,
};

use crate::admission::{Asking, Room, counted};
use crate::answer::{Desk, name_of};
use crate::approach::is_auto;
use crate::clock::StageClock;
use crate::direct::{self, Asked};
use crate::question::{checked_forces, pairs};
use crate::reject::Refusal;

/// What is wished for, and what it gets before anything is assembled.
pub(crate) struct Plan {
    wish: Wish,
    choice: Choice,
    asking: Asking,
    rates: Rates,
}

impl Plan {
    /// Element to assemble.
    fn element(&self) -> Element {
        self.choice.offer.element
    }

    /// The choice again, now that the factor's work is counted and time has gone by, among what
    /// fits.
    fn again(
        &self,
        analysed: &Analysed,
        elapsed_ms: f64,
        deadline_ms: Option<f64>,
        fits: impl Fn(FrontMethod) -> bool,
    ) -> Choice {
        let wish = Wish {
            element: ElementWish::Given(self.element()),
            deadline_ms: deadline_ms.map(|deadline| deadline - elapsed_ms),
            ..self.wish
        };
        let size = self.asking.problem.size;
        let counted = Work::estimate(size, self.element()).counted(analysed.analysis());
        let mut offers = offers_after_order(&wish, self.element(), &counted, &self.rates);
        offers.retain(|offer| FrontMethod::of(offer.method).is_none_or(&fits));
        let mut choice = choose(&wish, &offers).unwrap_or(self.choice);
        choice.offer.predicted_ms += elapsed_ms;
        Choice { locks: self.choice.locks, ..choice }
    }
}

impl Desk {
    /// A plan, where the request leaves something to be chosen.
    pub(crate) fn plan(
        &self,
        asking: &Asking,
        room: &mut Room,
        materials: &[Material],
        element: ElementChoice,
        question: &Question,
        clock: &StageClock,
    ) -> Result<Option<Plan>, Refusal> {
        let has_wish = question.deadline_ms.is_some() || question.max_error.is_some();
        let is_open = element == ElementChoice::Auto || (is_auto(question) && has_wish);
        if !is_open || question.method.as_str() == "condensed" {
            return Ok(None);
        }
        let method = match is_auto(question) {
            true if has_wish => None,
            // Without a wish the exact parallel factor stays what it is.
            true => Some(Method::Front),
            false => Some(question.method.as_str().parse()?),
        };
        let element = match element {
            ElementChoice::T4 => ElementWish::Given(Element::Tet4),
            ElementChoice::T10 => ElementWish::Given(Element::Tet10),
            ElementChoice::T4Anp => ElementWish::Given(Element::Tet4Anp),
            ElementChoice::Auto => {
                ElementWish::Auto { poisson_max: poisson_max(materials), memory_limit: room.free() }
            }
        };
        // Measuring, where it happens now, is time of this request like any other.
        let rates = self.rates.get();
        let deadline_ms = question.deadline_ms.map(|deadline| deadline - clock.elapsed_ms());
        let wish = Wish { method, element, deadline_ms, max_error: question.max_error };
        let all = offers(&wish, asking.problem.size, &rates);
        let need = |o: &Offer| Need::predicted(asking.problem, o.element, Way::Direct(o.method));
        // Ten-node elements beside linear ones are weighed by the choice itself, which says why.
        let is_weighed = |o: &Offer| {
            matches!(wish.element, ElementWish::Auto { .. }) && o.element == Element::Tet10
        };
        let fits = |o: &&Offer| is_weighed(o) || need(o).bytes_min() <= room.free();
        let fitting: Vec<Offer> = all.iter().filter(fits).copied().collect();
        let Some(choice) = choose(&wish, &fitting) else {
            let needs: Vec<Need> = all.iter().map(need).collect();
            return self.admit(room, &needs, asking).map(|_| None);
        };
        self.admit(room, &[need(&choice.offer)], asking)?;
        Ok(Some(Plan { wish, choice, asking: *asking, rates }))
    }

    /// Carries a plan out.
    pub(crate) fn solve_planned(
        &self,
        plan: &Plan,
        room: &mut Room,
        mesh: MeshData,
        materials: &[Material],
        question: &Question,
        mut clock: StageClock,
    ) -> Result<Answer, Refusal> {
        let element = name_of(plan.element());
        let model = self.model(mesh, materials, element, Vec::new(), &mut clock)?;
        let known = model.known(pairs(&question.known))?;
        let forces = checked_forces(&model, &known, question)?;
        let mut asked = Asked {
            question,
            known,
            forces,
            element,
            factor_reused: false,
            chosen_because: String::new(),
        };
        let (factored, solution, choice) = match FrontMethod::of(plan.choice.offer.method) {
            Some(_) => self.planned_front(plan, room, &model, &asked, &mut clock)?,
            None => {
                let method = plan.choice.offer.method;
                let dofs = &asked.known.dofs;
                let asking = Asking::about(&model, dofs.len(), None);
                let held = (&asking, model.bytes() as u64);
                let factored = self.factor(room, &model, dofs, &[method], held, &mut clock)?;
                let solution = direct::solve(&model, &factored, &asked, &mut clock)?;
                (factored, solution, Chosen { choice: plan.choice, fell_back: None })
            }
        };
        asked.chosen_because = choice.because(&plan.wish);
        let mut answer = direct::gather(&model, &factored, asked, &solution, clock)?;
        choice.warn(&mut answer.report);
        Ok(answer)
    }
}

/// Largest Poisson's ratio.
fn poisson_max(materials: &[Material]) -> f64 {
    materials.iter().map(|material| material.poisson).fold(-1.0, f64::max)
}

/// The element asked for; where it is left open, the cheapest that does not lock.
pub(crate) fn given_or_cheapest(element: ElementChoice, materials: &[Material]) -> ElementName {
    match element {
        ElementChoice::T4 => ElementName::T4,
        ElementChoice::T10 => ElementName::T10,
        ElementChoice::T4Anp => ElementName::T4Anp,
        ElementChoice::Auto => name_of(cheapest_element(poisson_max(materials))),
    }
}

/// Warns of linear elements on a material on which they lock.
pub(crate) fn add_locking(
    element: ElementChoice,
    materials: &[Material],
    report: &mut SolveReport,
) {
    let poisson = poisson_max(materials);
    if element == ElementChoice::T4 && poisson >= LOCKING_POISSON {
        report.warnings.push(format!(
            "linear elements lock at a Poisson's ratio of {poisson}: the object seems stiffer than \
             it is; ask for elements that do not (t4-anp, t10, auto)"
        ));
    }
}

/// What was chosen in the end, and from what it fell back.
struct Chosen {
    choice: Choice,
    fell_back: Option<String>,
}

impl Chosen {
    fn because(&self, wish: &Wish) -> String {
        let choice = match (wish.method, wish.deadline_ms, wish.max_error) {
            (Some(_), _, _) | (_, None, None) => String::new(),
            _ => self.choice.to_string(),
        };
        let element = match (wish.element, self.choice.offer.element) {
            (ElementWish::Auto { .. }, Element::Tet10) => format!(
                "ten-node elements, because linear ones lock from a Poisson's ratio of \
                 {LOCKING_POISSON} on"
            ),
            (ElementWish::Auto { .. }, Element::Tet4Anp) => format!(
                "linear elements with averaged nodal pressure, because plain ones lock from a \
                 Poisson's ratio of {LOCKING_POISSON} on and ten-node ones would take too much time \
                 or memory"
            ),
            (ElementWish::Auto { poisson_max, .. }, _) if poisson_max < LOCKING_POISSON => format!(
                "linear elements, because they do not lock below a Poisson's ratio of \
                 {LOCKING_POISSON}"
            ),
            _ => String::new(),
        };
        let parts = [Some(choice), Some(element), self.fell_back.clone()];
        let parts: Vec<String> = parts.into_iter().flatten().filter(|p| !p.is_empty()).collect();
        match parts.is_empty() {
            true => "asked for".to_owned(),
            false => parts.join("; "),
        }
    }

    fn warn(&self, report: &mut SolveReport) {
        report.warnings.extend(self.choice.gave_up.map(|gave_up: GaveUp| gave_up.to_string()));
        report.warnings.extend(self.choice.locks.map(|locks| locks.to_string()));
    }
}

impl Desk {
    /// Orders, chooses again by what is counted, factors and solves; where the chosen precision does
    /// not do, double precision does.
    fn planned_front(
        &self,
        plan: &Plan,
        room: &mut Room,
        model: &Model,
        asked: &Asked<'_>,
        clock: &mut StageClock,
    ) -> Result<(Factored, Solution, Chosen), Refusal> {
        let analysed = model.analyse(&asked.known.dofs, &mut |stage| clock.begin(stage))?;
        clock.end();
        let asking = Asking::about(model, asked.known.dofs.len(), None);
        let need = |front| counted(model, model.bytes() as u64, &analysed, front);
        let fits = |front| need(front).bytes() <= room.free();
        let choice = plan.again(&analysed, clock.elapsed_ms(), asked.question.deadline_ms, fits);
        let front = FrontMethod::of(choice.offer.method).unwrap_or(FrontMethod::Double);
        self.admit(room, &[need(front)], &asking)?;
        let double_need = need(FrontMethod::Double);
        let double = analysed.clone();
        let mut try_once = |analysed: Analysed, front| -> Result<_, Refusal> {
            let factored = analysed
                .factor(model.stiffness(), front, &mut |stage| clock.begin(stage))
                .map_err(|error| Refusal::Model(error.into()))?;
            let solution = direct::solve(model, &factored, asked, clock)?;
            Ok((factored, solution))
        };
        let fits_double = double_need.bytes() <= room.free();
        let first = try_once(analysed, front);
        let is_open = plan.wish.method.is_none() && front != FrontMethod::Double;
        let reason = match &first {
            Err(Refusal::Model(ModelError::Solve(SolveError::NotPositiveDefinite { .. })))
                if is_open =>
            {
                "single precision finds no factor".to_owned()
            }
            Ok((factored, solution))
                if is_open
                    && fits_double
                    && asked.question.deadline_ms.is_none()
                    && direct::certainty(model, factored, solution).is_none() =>
            {
                "single precision leaves no digit certain".to_owned()
            }
            // Where double precision does not fit, the answer there is is given, and warned of.
            Ok((_, solution))
                if is_open && fits_double && is_off(solution, choice.offer.error_rel) =>
            {
                format!("single precision gets to a residual of {:.0e} only", solution.residual_rel)
            }
            _ => {
                let (factored, solution) = first?;
                return Ok((factored, solution, Chosen { choice, fell_back: None }));
            }
        };
        drop(first);
        self.admit(room, &[double_need], &asking)?;
        let (factored, solution) = try_once(double, FrontMethod::Double)?;
        let fell_back = Some(format!("{reason}, so double precision was taken"));
        Ok((factored, solution, Chosen { choice, fell_back }))
    }
}

/// Whether a solution is further off than it was chosen for; refinement stops a little short of its
/// goal where rounding does.
fn is_off(solution: &Solution, error_rel: f64) -> bool {
    const SHORT_OF_GOAL: f64 = 10.0;
    let most = SHORT_OF_GOAL * error_rel;
    solution.residual_rel > most || solution.error_estimate_rel.is_some_and(|error| error > most)
}
