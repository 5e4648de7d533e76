//! Certificates: their validity, and self-signed ones for a lab that has no authority.

use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use x509_parser::certificate::X509Certificate;
use x509_parser::prelude::FromDer;
use x509_parser::time::ASN1Time;

const DAY: Duration = Duration::from_secs(86_400);
/// Time before now from which a made certificate is valid, for clients whose clock is late.
const BEFORE: Duration = DAY;
/// Largest number of days for which a certificate is made: a hundred years.
const DAYS_MAX: u32 = 36_500;

/// Time span in which a certificate is valid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Validity {
    from: ASN1Time,
    to: ASN1Time,
}

/// Why a certificate cannot be used.
#[derive(Debug, PartialEq, Eq, thiserror::Error)]
pub enum ValidityError {
    /// The certificate cannot be decoded.
    #[error("it is no X.509 certificate ({0})")]
    NotRead(String),
    /// The certificate has expired.
    #[error("it expired on {0}, and no client will trust it; replace it")]
    Expired(ASN1Time),
    /// The certificate is not valid yet.
    #[error("it is valid from {0} only; replace it, or set the clock of this machine")]
    NotYet(ASN1Time),
}

/// Why no certificate was made.
#[derive(Debug, thiserror::Error)]
pub enum MakeError {
    /// The names are none that a certificate can be made for.
    #[error(
        "no certificate can be made for {names}: {reason}; name hosts or addresses, as in lab.example,192.168.1.5"
    )]
    Names {
        /// The names as they were given.
        names: String,
        /// Reason given by the TLS library.
        reason: String,
    },
    /// A file cannot be written.
    #[error("cannot write {path}: {source}")]
    Write {
        /// Path of the file.
        path: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// The number of days is 0 or too large.
    #[error("a certificate is made for 1 to {DAYS_MAX} days, not for {0}")]
    Days(u32),
}

impl Validity {
    /// Validity of a certificate in DER form.
    ///
    /// # Errors
    /// [`ValidityError::NotRead`] if it cannot be decoded.
    pub fn of(der: &[u8]) -> Result<Self, ValidityError> {
        let (_, certificate) = X509Certificate::from_der(der)
            .map_err(|error| ValidityError::NotRead(error.to_string()))?;
        let validity = certificate.validity();
        Ok(Self { from: validity.not_before, to: validity.not_after })
    }

    /// Checks that a client whose clock is right trusts the certificate at this time.
    ///
    /// # Errors
    /// [`ValidityError`] if the certificate has expired or is not valid yet.
    pub fn check(&self, now: SystemTime) -> Result<(), ValidityError> {
        let now = unix_seconds(now);
        if now > self.to.timestamp() {
            return Err(ValidityError::Expired(self.to));
        }
        match now < self.from.timestamp() {
            true => Err(ValidityError::NotYet(self.from)),
            false => Ok(()),
        }
    }

    /// Last second of the validity, as Unix time, s.
    pub fn expires_s(&self) -> i64 {
        self.to.timestamp()
    }

    /// End of the validity as a text for people.
    pub fn expires_on(&self) -> String {
        self.to.to_string()
    }

    /// Whole days until the validity ends; 0 once it is over.
    pub fn days_left(&self, now: SystemTime) -> u64 {
        let seconds = self.to.timestamp().saturating_sub(unix_seconds(now));
        u64::try_from(seconds).unwrap_or(0) / DAY.as_secs()
    }
}

fn unix_seconds(time: SystemTime) -> i64 {
    let since = time.duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
    i64::try_from(since.as_secs()).unwrap_or(i64::MAX)
}

/// Makes a self-signed certificate for hosts and addresses that is valid from a day before now for `days`
/// days, and writes it with its key. The certificate is also what clients trust (`--tls-ca`). Only its
/// owner can read the key.
///
/// # Errors
/// [`MakeError`]; an existing file is not overwritten.
pub fn make_certificate(
    names: &[String],
    days: u32,
    certificate: &Path,
    key: &Path,
) -> Result<(), MakeError> {
    if !(1..=DAYS_MAX).contains(&days) {
        return Err(MakeError::Days(days));
    }
    let (made, made_key) = self_signed_now(names, days)?;
    write_new(key, &made_key, 0o600)?;
    write_new(certificate, &made, 0o644)
}

/// Self-signed certificate and its key as PEM texts, valid for `days` days; no file is written.
pub(crate) fn self_signed_now(names: &[String], days: u32) -> Result<(String, String), MakeError> {
    let now = SystemTime::now();
    self_signed(names, now - BEFORE, now + days * DAY)
        .map_err(|e| MakeError::Names { names: names.join(","), reason: e.to_string() })
}

fn self_signed(
    names: &[String],
    from: SystemTime,
    to: SystemTime,
) -> Result<(String, String), rcgen::Error> {
    let mut wanted = rcgen::CertificateParams::new(names.to_vec())?;
    wanted.not_before = from.into();
    wanted.not_after = to.into();
    let key = rcgen::KeyPair::generate()?;
    Ok((wanted.self_signed(&key)?.pem(), key.serialize_pem()))
}

fn write_new(path: &Path, text: &str, mode: u32) -> Result<(), MakeError> {
    use std::io::Write;
    let mut options = std::fs::OpenOptions::new();
    options.write(true).create_new(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut options, mode);
    #[cfg(not(unix))]
    let _ = mode;
    options
        .open(path)
        .and_then(|mut file| file.write_all(text.as_bytes()).and_then(|()| file.sync_all()))
        .map_err(|source| MakeError::Write { path: path.to_owned(), source })
}

#[cfg(test)]
mod tests {
    use tokio_rustls::rustls::pki_types::CertificateDer;
    use tokio_rustls::rustls::pki_types::pem::PemObject;

    use super::*;

    #[test]
    fn certificate_that_was_made_lives_as_long_as_stated_and_is_not_overwritten() {
        let folder = tempfile::tempdir().unwrap();
        let (certificate, key) = (folder.path().join("certificate"), folder.path().join("key"));
        let names = ["lab.example".to_owned(), "192.168.1.5".to_owned()];
        make_certificate(&names, 730, &certificate, &key).unwrap();
        let der = CertificateDer::from_pem_file(&certificate).unwrap();
        let validity = Validity::of(&der).unwrap();
        let now = SystemTime::now();
        assert_eq!(validity.check(now), Ok(()));
        assert!((729..=730).contains(&validity.days_left(now)), "{validity:?}");
        assert_eq!(validity.check(now - DAY + Duration::from_secs(60)), Ok(()));
        assert!(matches!(validity.check(now - 2 * DAY), Err(ValidityError::NotYet(_))));
        assert!(matches!(validity.check(now + 731 * DAY), Err(ValidityError::Expired(_))));
        let again = make_certificate(&names, 730, &certificate, &key);
        assert!(matches!(again, Err(MakeError::Write { .. })), "{again:?}");
        for days in [0, DAYS_MAX + 1] {
            let made = make_certificate(&names, days, &certificate, &key);
            assert!(matches!(made, Err(MakeError::Days(_))));
        }
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            let mode = std::fs::metadata(&key).unwrap().permissions().mode();
            assert_eq!(mode & 0o777, 0o600);
        }
        assert!(matches!(Validity::of(b"no certificate"), Err(ValidityError::NotRead(_))));
    }
}
