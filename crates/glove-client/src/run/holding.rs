//! Grasp that holds the object: the rules of the thesis, or contact with friction.

use nalgebra::Isometry3;
use softgrasp_grasp::grasp::{Contact, Grasp, GraspError, StateName, StepInput, StepOutput};

use crate::run::contact_grasp::{ContactGrasp, ContactScene};
use crate::run::shown::Shown;

/// Grasp that holds the object.
pub(crate) struct Holding {
    thesis: Grasp,
    /// Grasp by friction; it replaces the thesis's rules, which then only know the object's home.
    friction: Option<Box<ContactGrasp>>,
    /// Whether others lie on the table too, so that its height stays.
    keeps_table: bool,
}

impl Holding {
    /// Grasp by the rules of the thesis.
    pub(crate) fn new(thesis: Grasp) -> Self {
        Self { thesis, friction: None, keeps_table: false }
    }

    /// Changes to a grasp by contact with friction.
    pub(crate) fn by_friction(&mut self, scene: ContactScene, shown: &mut Shown) {
        let contact = ContactGrasp::new(scene, *self.thesis.home());
        shown.place(contact.world_from_object());
        self.friction = Some(Box::new(contact));
    }

    /// Keeps the table where it is from now on, because other objects lie on it too.
    pub(crate) fn keep_table(&mut self) {
        self.keeps_table = true;
    }

    /// Grasp by the thesis's rules, whether or not it holds the object.
    pub(crate) fn thesis(&self) -> &Grasp {
        &self.thesis
    }

    /// Plays a tick by the thesis's rules.
    pub(crate) fn step(&mut self, input: &StepInput) -> StepOutput {
        self.thesis.step(input)
    }

    /// Grasp by friction, if there is one.
    pub(crate) fn friction(&self) -> Option<&ContactGrasp> {
        self.friction.as_deref()
    }

    pub(crate) fn friction_mut(&mut self) -> Option<&mut ContactGrasp> {
        self.friction.as_deref_mut()
    }

    pub(crate) fn state_name(&self) -> StateName {
        match &self.friction {
            Some(contact) => contact.state_name(),
            None => self.thesis.state().name(),
        }
    }

    /// Contact of each fingertip by the thesis's rules, thumb first.
    pub(crate) fn contacts(&self) -> [Option<Contact>; 5] {
        self.thesis.state().contacts()
    }

    /// Releases the object at its pose.
    pub(crate) fn let_go(&mut self) {
        self.thesis.let_go();
        if let Some(contact) = &mut self.friction {
            contact.let_go();
        }
    }

    /// Puts a free object at a pose.
    ///
    /// # Errors
    /// [`GraspError`] while the hand holds it.
    pub(crate) fn place(&mut self, pose: Isometry3<f64>) -> Result<(), GraspError> {
        match &mut self.friction {
            Some(contact) if contact.state_name() == StateName::Deforming => {
                return Err(GraspError::Held);
            }
            Some(contact) => contact.put(pose),
            None => self.thesis.place(pose)?,
        }
        Ok(())
    }

    /// Sets another home and puts the object there.
    ///
    /// # Errors
    /// [`GraspError`] while the hand holds it.
    pub(crate) fn set_home(&mut self, home: Isometry3<f64>) -> Result<(), GraspError> {
        self.thesis.set_home(home)?;
        if let Some(contact) = &mut self.friction {
            contact.set_home(home);
        }
        Ok(())
    }

    /// Releases the object and puts it back to its home. A table is as high as the lowest point of the
    /// object there, or the object lies as high as the table that it shares.
    pub(crate) fn put_home(&mut self, shown: &mut Shown) {
        self.thesis.let_go();
        if self.keeps_table {
            return self.lie_on_table(shown);
        }
        let home = *self.thesis.home();
        // Nothing holds it any more.
        if self.thesis.place(home).is_ok() {
            shown.place(home);
        }
        if let Some(contact) = &mut self.friction {
            let lowest = home.translation.y + shown.object().rest_shape().bottom();
            let table_y = contact.scene().table_y.map(|_| lowest);
            contact.meet_new_object(table_y);
            shown.place(contact.world_from_object());
        }
    }

    /// Puts the object back to its home, as high as the table is.
    fn lie_on_table(&mut self, shown: &mut Shown) {
        let Some(contact) = &mut self.friction else { return };
        let mut home = *self.thesis.home();
        if let Some(table_y) = contact.scene().table_y {
            home.translation.y = table_y - shown.object().rest_shape().bottom();
        }
        contact.lie_at(home);
        // Nothing holds it any more.
        if self.thesis.set_home(home).is_ok() {
            shown.place(home);
        }
    }
}
